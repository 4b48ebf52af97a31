// Embree's oriented discs on the work files: how long a cast takes, and what it finds.
//
//   cast SURFELS RAYS [--isa sse4.2|avx|avx2|avx512]
//
// One line of input is one request: `go MODE` casts all rays once and answers with the seconds, `ranges MODE OUT` writes the
// ranges and answers `ok`. The end of input ends the program. Modes: `single` (rtcIntersect1), and `wide16-bounded`
// (rtcIntersect16, coherent), which ends each ray 5 m behind its measured range.

#include "work.hpp"

#include <pmmintrin.h>
#include <xmmintrin.h>

#include <algorithm>
#include <iostream>
#include <limits>
#include <sstream>

namespace {

constexpr float BOUND_M = 5.0f;
constexpr unsigned WIDTH = 16;

RTCScene build(RTCDevice device, const std::vector<Surfel>& surfels) {
    RTCGeometry discs = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
    rtcSetGeometryBuildQuality(discs, RTC_BUILD_QUALITY_HIGH);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(discs, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                 RTC_FORMAT_FLOAT4, 16, surfels.size()));
    auto* normals = static_cast<float*>(rtcSetNewGeometryBuffer(discs, RTC_BUFFER_TYPE_NORMAL, 0,
                                                                RTC_FORMAT_FLOAT3, 12, surfels.size()));
    for (std::size_t k = 0; k < surfels.size(); ++k) {
        std::copy_n(surfels[k].centre, 3, vertices + 4 * k);
        vertices[4 * k + 3] = surfels[k].radius;
        std::copy_n(surfels[k].normal, 3, normals + 3 * k);
    }
    rtcCommitGeometry(discs);
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    rtcAttachGeometry(scene, discs);
    rtcReleaseGeometry(discs);
    rtcCommitScene(scene);
    return scene;
}

float range_of(unsigned geometry, float t) {
    return geometry == RTC_INVALID_GEOMETRY_ID ? std::numeric_limits<float>::quiet_NaN() : t;
}

void cast_single(RTCScene scene, const std::vector<Ray>& rays, std::vector<float>& ranges) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (std::size_t k = 0; k < rays.size(); ++k) {
        const Ray& ray = rays[k];
        RTCRayHit query{};
        query.ray.org_x = ray.origin[0], query.ray.org_y = ray.origin[1], query.ray.org_z = ray.origin[2];
        query.ray.dir_x = ray.direction[0], query.ray.dir_y = ray.direction[1], query.ray.dir_z = ray.direction[2];
        query.ray.tfar = std::numeric_limits<float>::infinity(), query.ray.mask = ~0u;
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID, query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene, &context, &query);
        ranges[k] = range_of(query.hit.geomID, query.ray.tfar);
    }
}

void cast_wide(RTCScene scene, const std::vector<Ray>& rays, std::vector<float>& ranges) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    alignas(64) int valid[WIDTH];
    alignas(64) RTCRayHit16 packet;
    for (std::size_t first = 0; first < rays.size(); first += WIDTH) {
        const auto count = static_cast<unsigned>(std::min<std::size_t>(WIDTH, rays.size() - first));
        for (unsigned k = 0; k < WIDTH; ++k) {
            // Behind the last ray stand copies of it, switched off.
            const Ray& ray = rays[first + std::min(k, count - 1)];
            valid[k] = k < count ? -1 : 0;
            packet.ray.org_x[k] = ray.origin[0], packet.ray.org_y[k] = ray.origin[1];
            packet.ray.org_z[k] = ray.origin[2], packet.ray.tnear[k] = 0.0f;
            packet.ray.dir_x[k] = ray.direction[0], packet.ray.dir_y[k] = ray.direction[1];
            packet.ray.dir_z[k] = ray.direction[2], packet.ray.time[k] = 0.0f;
            packet.ray.tfar[k] = ray.measured + BOUND_M;
            packet.ray.mask[k] = ~0u, packet.ray.id[k] = k, packet.ray.flags[k] = 0;
            packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID, packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
        }
        rtcIntersect16(valid, scene, &context, &packet);
        for (unsigned k = 0; k < count; ++k) ranges[first + k] = range_of(packet.hit.geomID[k], packet.ray.tfar[k]);
    }
}

void run(int count, char** words) {
    // As Embree's manual asks for.
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    Options options(count, words);
    const auto surfels = read_records<Surfel>(options.file("surfels"));
    const auto rays = read_records<Ray>(options.file("rays"));
    const std::string isa = options.value("--isa", "");
    options.done();
    // Embree itself takes any other word for the least it knows.
    if (!isa.empty() && isa != "sse4.2" && isa != "avx" && isa != "avx2" && isa != "avx512")
        throw std::runtime_error(isa + ": unknown isa");
    const RTCDevice device = open_device("threads=1,set_affinity=0" + (isa.empty() ? "" : ",isa=" + isa));
    const double build_start_s = now_s();
    const RTCScene scene = build(device, surfels);
    std::cout << "ready " << surfels.size() << " surfels, " << rays.size() << " rays, built in "
              << now_s() - build_start_s << " s" << std::endl;
    std::vector<float> ranges(rays.size());
    for (std::string line; std::getline(std::cin, line);) {
        std::istringstream request(line);
        std::string verb, mode, path;
        request >> verb >> mode;
        const double start_s = now_s();
        if (mode == "single") cast_single(scene, rays, ranges);
        else if (mode == "wide16-bounded") cast_wide(scene, rays, ranges);
        else throw std::runtime_error(mode + ": unknown mode");
        const double taken_s = now_s() - start_s;
        if (verb == "go") {
            std::cout << taken_s << std::endl;
        } else if (verb == "ranges" && std::getline(request >> std::ws, path)) {
            write_numbers(path, ranges);
            std::cout << "ok" << std::endl;
        } else {
            throw std::runtime_error(line + ": unknown request");
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
