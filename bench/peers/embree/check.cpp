// Exact ranges. Embree proposes the discs whose boxes, enlarged by 1 mm, a ray meets; every crossing is computed in f64
// from the numbers of the files.
//
//   check SURFELS RAYS OUT --support FILE --segments FILE [--brute N]
//
// Writes OUT.first, OUT.nearest (nearest to the measured range, within 5 m) and OUT.independent (first of the surfels that owe
// nothing to the ray's segment and one segment to either side): one f64 a ray, NaN for a miss. A crossing counts where
// |n·d| >= 0.01, at or in front of the origin, within the radius. `--brute N` compares N rays, spread over the file, with all
// surfels without a tree.

#include "work.hpp"

#include <cmath>
#include <limits>

namespace {

constexpr double MIN_COSINE = 0.01, MARGIN_M = 1e-3, WINDOW_M = 5.0;
constexpr std::int64_t REACH = 1;
constexpr double NO_RANGE = std::numeric_limits<double>::quiet_NaN();
enum Answer { FIRST, NEAREST, INDEPENDENT };
constexpr const char* NAMES[] = {"first", "nearest", "independent"};

struct Work {
    std::vector<Surfel> surfels;
    std::vector<Ray> rays;
    std::vector<Support> support;
    std::vector<std::int32_t> segments;
};

// Where the ray crosses the disc, metres; NaN where it does not.
double crossing_m(const Surfel& surfel, const Ray& ray) {
    double cosine = 0.0, ahead_m = 0.0;
    for (int k = 0; k < 3; ++k) {
        cosine += double(surfel.normal[k]) * double(ray.direction[k]);
        ahead_m += double(surfel.normal[k]) * (double(surfel.centre[k]) - double(ray.origin[k]));
    }
    if (std::abs(cosine) < MIN_COSINE) return NO_RANGE;
    const double t_m = ahead_m / cosine;
    double off_m2 = 0.0;
    for (int k = 0; k < 3; ++k) {
        const double off_m = double(ray.origin[k]) + t_m * double(ray.direction[k]) - double(surfel.centre[k]);
        off_m2 += off_m * off_m;
    }
    const double radius_m = surfel.radius;
    return t_m >= 0.0 && off_m2 <= radius_m * radius_m ? t_m : NO_RANGE;
}

// What is sought for one ray, and the best so far.
struct Search {
    RTCIntersectContext context;  // first: Embree hands its address back
    const Work* work;
    const Ray* ray;
    Answer answer;
    std::int64_t segment;
    double best_m;

    // Takes a disc into account; says up to which range better ones may lie.
    void look_at(std::size_t surfel) {
        if (answer == INDEPENDENT) {
            const Support& seen = work->support[surfel];
            if (!(seen.third_lowest < segment - REACH || seen.third_highest > segment + REACH)) return;
        }
        const double t_m = crossing_m(work->surfels[surfel], *ray);
        if (std::isnan(t_m)) return;
        if (answer == NEAREST) {
            const double off_m = std::abs(t_m - ray->measured);
            const double best_off_m = std::abs(best_m - ray->measured);
            // Of two as near, the nearer to the sensor.
            if (off_m <= WINDOW_M && !(off_m > best_off_m) && !(off_m == best_off_m && t_m > best_m)) best_m = t_m;
        } else if (!(t_m >= best_m)) {
            best_m = t_m;
        }
    }
    double end_m() const {
        if (answer != NEAREST) return std::isnan(best_m) ? std::numeric_limits<double>::infinity() : best_m;
        return ray->measured + (std::isnan(best_m) ? WINDOW_M : std::abs(best_m - ray->measured));
    }
};

void bounds_of(const RTCBoundsFunctionArguments* arguments) {
    const Surfel& surfel = static_cast<const Work*>(arguments->geometryUserPtr)->surfels[arguments->primID];
    float low[3], high[3];
    for (int k = 0; k < 3; ++k) {
        const double n = surfel.normal[k];
        const double half_m = surfel.radius * std::sqrt(std::max(0.0, 1.0 - n * n)) + MARGIN_M;
        low[k] = float(surfel.centre[k] - half_m), high[k] = float(surfel.centre[k] + half_m);
    }
    RTCBounds& bounds = *arguments->bounds_o;
    bounds.lower_x = low[0], bounds.lower_y = low[1], bounds.lower_z = low[2];
    bounds.upper_x = high[0], bounds.upper_y = high[1], bounds.upper_z = high[2];
}

void look(const RTCIntersectFunctionNArguments* arguments) {
    if (arguments->N != 1 || arguments->valid[0] != -1) return;
    auto* search = reinterpret_cast<Search*>(arguments->context);
    search->look_at(arguments->primID);
    RTCRayN* ray = RTCRayHitN_RayN(arguments->rayhit, 1);
    RTCRayN_tfar(ray, 1, 0) = float(search->end_m() + MARGIN_M);
}

double range_m(RTCScene scene, const Work& work, std::size_t index, Answer answer) {
    const Ray& ray = work.rays[index];
    Search search{};
    rtcInitIntersectContext(&search.context);
    search.work = &work, search.ray = &ray, search.answer = answer, search.best_m = NO_RANGE;
    search.segment = answer == INDEPENDENT ? work.segments[index] : 0;
    if (scene == nullptr) {
        for (std::size_t k = 0; k < work.surfels.size(); ++k) search.look_at(k);
        return search.best_m;
    }
    RTCRayHit query{};
    query.ray.org_x = ray.origin[0], query.ray.org_y = ray.origin[1], query.ray.org_z = ray.origin[2];
    query.ray.dir_x = ray.direction[0], query.ray.dir_y = ray.direction[1], query.ray.dir_z = ray.direction[2];
    query.ray.tnear = answer == NEAREST ? std::max(0.0f, float(ray.measured - WINDOW_M - MARGIN_M)) : 0.0f;
    query.ray.tfar = float(search.end_m() + MARGIN_M);
    query.ray.mask = ~0u, query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &search.context, &query);
    return search.best_m;
}

RTCScene build(RTCDevice device, Work& work) {
    RTCGeometry discs = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(discs, static_cast<unsigned>(work.surfels.size()));
    rtcSetGeometryUserData(discs, &work);
    rtcSetGeometryBoundsFunction(discs, [](const RTCBoundsFunctionArguments* a) { bounds_of(a); }, nullptr);
    rtcSetGeometryIntersectFunction(discs, look);
    rtcCommitGeometry(discs);
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcAttachGeometry(scene, discs);
    rtcReleaseGeometry(discs);
    rtcCommitScene(scene);
    return scene;
}

void run(int count, char** words) {
    Options options(count, words);
    Work work;
    work.surfels = read_records<Surfel>(options.file("surfels"));
    work.rays = read_records<Ray>(options.file("rays"));
    const std::string out = options.file("name for the ranges");
    work.support = read_records<Support>(options.value("--support", ""));
    work.segments = read_records<std::int32_t>(options.value("--segments", ""));
    const auto brute = static_cast<std::size_t>(std::stoul(options.value("--brute", "0")));
    options.done();
    if (work.support.size() != work.surfels.size() || work.segments.size() != work.rays.size())
        throw std::runtime_error("support or segments are not as many as surfels and rays");
    RTCScene scene = build(open_device("set_affinity=0"), work);
    for (const Answer answer : {FIRST, NEAREST, INDEPENDENT}) {
        std::vector<double> ranges_m(work.rays.size());
        std::size_t misses = 0;
        for (std::size_t k = 0; k < ranges_m.size(); ++k) {
            ranges_m[k] = range_m(scene, work, k, answer);
            misses += std::isnan(ranges_m[k]) ? 1 : 0;
        }
        const std::string path = out + "." + NAMES[answer];
        write_numbers(path, ranges_m);
        std::printf("%s: %zu rays, %zu misses\n", NAMES[answer], ranges_m.size(), misses);
        for (std::size_t n = 0; n < std::min(brute, ranges_m.size()); ++n) {
            const std::size_t k = n * ranges_m.size() / std::min(brute, ranges_m.size());
            const double exact_m = range_m(nullptr, work, k, answer);
            if (exact_m != ranges_m[k] && !(std::isnan(exact_m) && std::isnan(ranges_m[k])))
                throw std::runtime_error(path + ": ray " + std::to_string(k) + ": " + std::to_string(ranges_m[k]) +
                                         " m, without a tree " + std::to_string(exact_m) + " m");
        }
    }
}

}  // namespace

int main(int count, char** words) {
    try {
        run(count, words);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "error: %s\n", error.what());
        return 1;
    }
}
