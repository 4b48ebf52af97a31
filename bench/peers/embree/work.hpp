// The work files, and what both programs do with them.
#pragma once

#include <embree3/rtcore.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

// As the files hold them: little-endian f32, metres.
struct Surfel {
    float centre[3], normal[3], radius;
};
struct Ray {
    float origin[3], direction[3], measured;
};
struct Support {
    std::int32_t third_lowest, third_highest;
};
static_assert(sizeof(Surfel) == 28 && sizeof(Ray) == 28 && sizeof(Support) == 8, "the files have no padding");

template <typename Record>
std::vector<Record> read_records(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) throw std::runtime_error(path + ": cannot open");
    const auto bytes = static_cast<std::size_t>(file.tellg());
    if (bytes % sizeof(Record) != 0)
        throw std::runtime_error(path + ": " + std::to_string(bytes) + " bytes are no whole records of " +
                                 std::to_string(sizeof(Record)));
    std::vector<Record> records(bytes / sizeof(Record));
    file.seekg(0);
    if (!file.read(reinterpret_cast<char*>(records.data()), static_cast<std::streamsize>(bytes)))
        throw std::runtime_error(path + ": cannot read");
    return records;
}

template <typename Number>
void write_numbers(const std::string& path, const std::vector<Number>& numbers) {
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(numbers.data()),
               static_cast<std::streamsize>(numbers.size() * sizeof(Number)));
    file.flush();
    if (!file) throw std::runtime_error(path + ": cannot write");
}

inline double now_s() {
    using namespace std::chrono;
    return duration<double>(steady_clock::now().time_since_epoch()).count();
}

inline RTCDevice open_device(const std::string& config) {
    RTCDevice device = rtcNewDevice(config.c_str());
    if (device == nullptr)
        throw std::runtime_error("Embree: no device, error " + std::to_string(rtcGetDeviceError(nullptr)));
    const auto report = [](void*, RTCError code, const char* text) {
        std::fprintf(stderr, "error: Embree %d: %s\n", static_cast<int>(code), text);
        std::exit(1);
    };
    rtcSetDeviceErrorFunction(device, report, nullptr);
    return device;
}

// Options as `--name VALUE` after the files.
class Options {
public:
    Options(int count, char** words) : words_(words + 1, words + count) {}

    // The next file; they come first.
    std::string file(const char* what) {
        if (words_.empty() || words_.front().rfind("--", 0) == 0) throw std::runtime_error(std::string("no ") + what);
        std::string path = words_.front();
        words_.erase(words_.begin());
        return path;
    }
    std::string value(const std::string& name, const std::string& otherwise) {
        for (std::size_t k = 0; k < words_.size(); ++k) {
            if (words_[k] != name) continue;
            if (k + 1 == words_.size()) throw std::runtime_error(name + " needs a value");
            std::string found = words_[k + 1];
            words_.erase(words_.begin() + static_cast<std::ptrdiff_t>(k), words_.begin() + static_cast<std::ptrdiff_t>(k) + 2);
            return found;
        }
        return otherwise;
    }
    void done() const {
        if (!words_.empty()) throw std::runtime_error(words_.front() + ": unknown option");
    }

private:
    std::vector<std::string> words_;
};
