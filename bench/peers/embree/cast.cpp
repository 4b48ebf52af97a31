// Embree's oriented discs on the work files: how long a cast takes, and what it finds.
//
//   cast SURFELS RAYS [--mode MODE] [--reps N] [--ranges OUT] [--bound M] [--quality low|medium|high]
//        [--flags none|compact|robust|compact+robust] [--isa sse4.2|avx|avx2|avx512] [--hugepages] [--serve]
//
// Modes: single, wide4, wide8, wide16 (rtcIntersect1, 4, 8, 16) and stream (rtcIntersect1M). Suffixes:
// -bounded ends each ray at its measured range plus --bound; -incoherent withholds the hint of coherence
// (single rays have none); -filter refuses grazing hits, |n·d| < 0.01, as the project does.
//
// With --serve, one line of input is one request: `go MODE` casts all rays once and answers with the
// seconds, `ranges MODE OUT` writes the ranges and answers `ok`, `rays FILE` goes over to other rays and
// answers `ok`; the end of input ends the program.

#include "work.hpp"

#include <pmmintrin.h>
#include <xmmintrin.h>

#include <algorithm>
#include <iostream>
#include <limits>
#include <sstream>

namespace {

constexpr float MIN_COSINE = 0.01f;
constexpr unsigned STREAM_RAYS = 256;

struct Mode {
    unsigned width = 1;  // 0: a stream
    bool bounded = false, coherent = true, filter = false;
};

Mode mode_of(std::string name) {
    Mode mode;
    const std::string whole = name;
    for (bool found = true; found;) {
        found = false;
        const auto ends = [&](const std::string& suffix) {
            const bool yes = name.size() > suffix.size() && name.substr(name.size() - suffix.size()) == suffix;
            if (yes) name.resize(name.size() - suffix.size());
            found |= yes;
            return yes;
        };
        if (ends("-bounded")) mode.bounded = true;
        if (ends("-incoherent")) mode.coherent = false;
        if (ends("-filter")) mode.filter = true;
    }
    if (name == "single") mode.width = 1, mode.coherent = false;
    else if (name == "wide4") mode.width = 4;
    else if (name == "wide8") mode.width = 8;
    else if (name == "wide16") mode.width = 16;
    else if (name == "stream") mode.width = 0;
    else throw std::runtime_error(whole + ": unknown mode");
    return mode;
}

struct Settings {
    RTCBuildQuality quality = RTC_BUILD_QUALITY_HIGH;
    unsigned flags = RTC_SCENE_FLAG_NONE;
    float bound_m = 5.0f;
};

void refuse_grazing(const RTCFilterFunctionNArguments* arguments) {
    const auto* surfels = static_cast<const Surfel*>(arguments->geometryUserPtr);
    for (unsigned k = 0; k < arguments->N; ++k) {
        if (arguments->valid[k] != -1) continue;
        const float* n = surfels[RTCHitN_primID(arguments->hit, arguments->N, k)].normal;
        const float cosine = n[0] * RTCRayN_dir_x(arguments->ray, arguments->N, k) +
                             n[1] * RTCRayN_dir_y(arguments->ray, arguments->N, k) +
                             n[2] * RTCRayN_dir_z(arguments->ray, arguments->N, k);
        if (std::abs(cosine) < MIN_COSINE) arguments->valid[k] = 0;
    }
}

RTCScene build(RTCDevice device, std::vector<Surfel>& surfels, const Settings& settings, bool filter) {
    RTCGeometry discs = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
    rtcSetGeometryBuildQuality(discs, settings.quality);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(discs, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                 RTC_FORMAT_FLOAT4, 16, surfels.size()));
    auto* normals = static_cast<float*>(rtcSetNewGeometryBuffer(discs, RTC_BUFFER_TYPE_NORMAL, 0,
                                                                RTC_FORMAT_FLOAT3, 12, surfels.size()));
    for (std::size_t k = 0; k < surfels.size(); ++k) {
        std::copy_n(surfels[k].centre, 3, vertices + 4 * k);
        vertices[4 * k + 3] = surfels[k].radius;
        std::copy_n(surfels[k].normal, 3, normals + 3 * k);
    }
    if (filter) {
        rtcSetGeometryUserData(discs, surfels.data());
        rtcSetGeometryIntersectFilterFunction(discs, refuse_grazing);
    }
    rtcCommitGeometry(discs);
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, settings.quality);
    rtcSetSceneFlags(scene, static_cast<RTCSceneFlags>(settings.flags));
    rtcAttachGeometry(scene, discs);
    rtcReleaseGeometry(discs);
    rtcCommitScene(scene);
    return scene;
}

// The range at which a ray ends.
float end_of(const Ray& ray, const Mode& mode, const Settings& settings) {
    return mode.bounded ? ray.measured + settings.bound_m : std::numeric_limits<float>::infinity();
}

float range_of(unsigned geometry, float t) {
    return geometry == RTC_INVALID_GEOMETRY_ID ? std::numeric_limits<float>::quiet_NaN() : t;
}

RTCRayHit single_ray(const Ray& ray, float end_m) {
    RTCRayHit query{};
    query.ray.org_x = ray.origin[0], query.ray.org_y = ray.origin[1], query.ray.org_z = ray.origin[2];
    query.ray.dir_x = ray.direction[0], query.ray.dir_y = ray.direction[1], query.ray.dir_z = ray.direction[2];
    query.ray.tnear = 0.0f, query.ray.tfar = end_m, query.ray.mask = ~0u;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID, query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    return query;
}

template <typename Packet, unsigned WIDTH, void (*INTERSECT)(const int*, RTCScene, RTCIntersectContext*, Packet*)>
void cast_wide(RTCScene scene, RTCIntersectContext& context, const std::vector<Ray>& rays, const Mode& mode,
               const Settings& settings, std::vector<float>& ranges) {
    alignas(64) int valid[WIDTH];
    alignas(64) Packet packet;
    for (std::size_t first = 0; first < rays.size(); first += WIDTH) {
        const auto count = static_cast<unsigned>(std::min<std::size_t>(WIDTH, rays.size() - first));
        for (unsigned k = 0; k < WIDTH; ++k) {
            // Beyond the last ray its like stands, switched off.
            const Ray& ray = rays[first + std::min(k, count - 1)];
            valid[k] = k < count ? -1 : 0;
            packet.ray.org_x[k] = ray.origin[0], packet.ray.org_y[k] = ray.origin[1];
            packet.ray.org_z[k] = ray.origin[2], packet.ray.tnear[k] = 0.0f;
            packet.ray.dir_x[k] = ray.direction[0], packet.ray.dir_y[k] = ray.direction[1];
            packet.ray.dir_z[k] = ray.direction[2], packet.ray.time[k] = 0.0f;
            packet.ray.tfar[k] = end_of(ray, mode, settings);
            packet.ray.mask[k] = ~0u, packet.ray.id[k] = k, packet.ray.flags[k] = 0;
            packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID, packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
        }
        INTERSECT(valid, scene, &context, &packet);
        for (unsigned k = 0; k < count; ++k) ranges[first + k] = range_of(packet.hit.geomID[k], packet.ray.tfar[k]);
    }
}

// Casts all rays once.
void cast(RTCScene scene, const std::vector<Ray>& rays, const Mode& mode, const Settings& settings,
          std::vector<float>& ranges) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = mode.coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    switch (mode.width) {
    case 4: return cast_wide<RTCRayHit4, 4, rtcIntersect4>(scene, context, rays, mode, settings, ranges);
    case 8: return cast_wide<RTCRayHit8, 8, rtcIntersect8>(scene, context, rays, mode, settings, ranges);
    case 16: return cast_wide<RTCRayHit16, 16, rtcIntersect16>(scene, context, rays, mode, settings, ranges);
    case 1:
        for (std::size_t k = 0; k < rays.size(); ++k) {
            RTCRayHit query = single_ray(rays[k], end_of(rays[k], mode, settings));
            rtcIntersect1(scene, &context, &query);
            ranges[k] = range_of(query.hit.geomID, query.ray.tfar);
        }
        return;
    default:
        alignas(64) static RTCRayHit queries[STREAM_RAYS];
        for (std::size_t first = 0; first < rays.size(); first += STREAM_RAYS) {
            const auto count = static_cast<unsigned>(std::min<std::size_t>(STREAM_RAYS, rays.size() - first));
            for (unsigned k = 0; k < count; ++k)
                queries[k] = single_ray(rays[first + k], end_of(rays[first + k], mode, settings));
            rtcIntersect1M(scene, &context, queries, count, sizeof(RTCRayHit));
            for (unsigned k = 0; k < count; ++k)
                ranges[first + k] = range_of(queries[k].hit.geomID, queries[k].ray.tfar);
        }
    }
}

Settings settings_of(Options& options) {
    Settings settings;
    const std::string quality = options.value("--quality", "high"), flags = options.value("--flags", "none");
    if (quality == "low") settings.quality = RTC_BUILD_QUALITY_LOW;
    else if (quality == "medium") settings.quality = RTC_BUILD_QUALITY_MEDIUM;
    else if (quality != "high") throw std::runtime_error(quality + ": unknown quality");
    if (flags.find("compact") != std::string::npos) settings.flags |= RTC_SCENE_FLAG_COMPACT;
    if (flags.find("robust") != std::string::npos) settings.flags |= RTC_SCENE_FLAG_ROBUST;
    settings.bound_m = std::stof(options.value("--bound", "5"));
    return settings;
}

void run(int count, char** words) {
    // As Embree's manual asks for.
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    Options options(count, words);
    std::vector<Surfel> surfels = read_records<Surfel>(options.file("surfels"));
    std::vector<Ray> rays = read_records<Ray>(options.file("rays"));
    const Settings settings = settings_of(options);
    const std::string name = options.value("--mode", "single"), out = options.value("--ranges", "");
    const int repetitions = std::stoi(options.value("--reps", "5"));
    const std::string isa = options.value("--isa", "");
    // Embree itself takes any other word for the least it knows.
    if (!isa.empty() && isa != "sse4.2" && isa != "avx" && isa != "avx2" && isa != "avx512")
        throw std::runtime_error(isa + ": unknown isa");
    const RTCDevice device = open_device("threads=1,set_affinity=0" + (isa.empty() ? "" : ",isa=" + isa) +
                                         (options.is_set("--hugepages") ? ",hugepages=1" : ""));
    const bool serve = options.is_set("--serve");
    options.done();

    RTCScene scenes[2] = {nullptr, nullptr};  // without and with the filter
    double build_s = 0.0;
    const auto scene_of = [&](const Mode& mode) {
        RTCScene& scene = scenes[mode.filter ? 1 : 0];
        if (scene == nullptr) {
            const double start_s = now_s();
            scene = build(device, surfels, settings, mode.filter);
            build_s = now_s() - start_s;
        }
        return scene;
    };
    std::vector<float> ranges(rays.size());
    const auto cast_once_s = [&](const std::string& which) {
        const Mode mode = mode_of(which);
        RTCScene scene = scene_of(mode);
        const double start_s = now_s();
        cast(scene, rays, mode, settings, ranges);
        return now_s() - start_s;
    };

    if (serve) {
        scene_of(Mode{});
        std::cout << "ready " << surfels.size() << " surfels, " << rays.size() << " rays, built in " << build_s << " s"
                  << std::endl;
        for (std::string line; std::getline(std::cin, line);) {
            std::istringstream request(line);
            std::string verb, which, path;
            request >> verb;
            if (verb == "rays" && std::getline(request >> std::ws, path)) {
                rays = read_records<Ray>(path);
                ranges.resize(rays.size());
                std::cout << "ok" << std::endl;
                continue;
            }
            request >> which;
            const double taken_s = cast_once_s(which);
            if (verb == "go") {
                std::cout << taken_s << std::endl;
            } else if (verb == "ranges" && std::getline(request >> std::ws, path)) {
                write_numbers(path, ranges);
                std::cout << "ok" << std::endl;
            } else {
                throw std::runtime_error(line + ": unknown request");
            }
        }
        return;
    }
    cast_once_s(name);  // warm
    std::vector<double> speeds;
    for (int k = 0; k < repetitions; ++k) speeds.push_back(static_cast<double>(rays.size()) / cast_once_s(name) / 1e6);
    std::sort(speeds.begin(), speeds.end());
    const auto misses = std::count_if(ranges.begin(), ranges.end(), [](float range) { return range != range; });
    std::printf("%s: %zu surfels built in %.3f s; %zu rays, %td misses", name.c_str(), surfels.size(), build_s,
                rays.size(), misses);
    if (!speeds.empty())
        std::printf("; %.3f M rays/s (%.3f to %.3f, %d casts)", speeds[speeds.size() / 2], speeds.front(), speeds.back(),
                    repetitions);
    std::printf("\n");
    if (!out.empty()) write_numbers(out, ranges);
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
