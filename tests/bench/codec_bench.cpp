// Prints bits per vertex and milliseconds of the strand codecs, and of raw lattices under zstd in the same
// run, for test motions, the built-in scene, and our models on motion capture where its files are.
// usage: codec_bench [--mocap DIR] [frames [part of a scene's name]]
#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string_view>

#include "common/base/profile.h"
#include "common/strands/strand_codec.h"
#include "tests/bench/codec_motions.h"

namespace strandcast {
namespace {

constexpr float kBoundM = 1e-4f;
constexpr int kWarmUpFrames = 60;
constexpr int kStartFrames = 9;  // the first differences are not yet typical
constexpr double kRateHz = 60.0;

struct Row {
  StageTimer encode;
  StageTimer decode;
  double bytes = 0.0;
  double keyframe_bytes = 0.0;
};

void print(const char* scene, const char* codec, const Row& row, size_t vertex_count, int frames) {
  const double vertices = static_cast<double>(vertex_count);
  const double bits_per_vertex = 8.0 * row.bytes / frames / vertices;
  fmt::print("{},{},{},{:.2f},{:.2f},{:.2f},{:.3f},{:.3f}\n", scene, codec, vertex_count, bits_per_vertex,
             bits_per_vertex * vertices * kRateHz * 1e-6, 8.0 * row.keyframe_bytes / vertices,
             row.encode.median_ms(), row.decode.median_ms());
}

/// Largest distance between the vertices of two snapshots of the same sizes, m.
double largest_error_m(const Snapshot& a, const Snapshot& b) {
  const std::vector<glm::vec3> x = positions_in_head(a);
  const std::vector<glm::vec3> y = positions_in_head(b);
  double largest = 0.0;
  for (size_t i = 0; i < x.size(); ++i)
    largest = std::max(largest, glm::distance(glm::dvec3(x[i]), glm::dvec3(y[i])));
  return largest;
}

bool run_codec(const char* scene, const std::string& codec, const Recording& recording) {
  const float quantum_m = lattice_step_m(codec, kBoundM).value();
  auto encoder = make_strand_encoder(codec);
  auto decoder =
      make_strand_decoder(codec, {recording.states[0].strand_count, recording.states[0].vertex_count});
  if (!encoder || !decoder) return false;
  (*encoder)->set_rest_shape(recording.rest_in_head_m);
  (*decoder)->set_rest_shape(recording.rest_in_head_m);
  Row row;
  const int frames = static_cast<int>(recording.states.size()) - kStartFrames - 1;
  for (int i = 0; i < kStartFrames + frames; ++i) {
    const Snapshot snapshot = on_lattice(recording.states[static_cast<size_t>(i)], quantum_m);
    const int64_t begin_ns = now_ns();
    const EncodedFramePtr frame = (*encoder)->encode(snapshot);
    const int64_t middle_ns = now_ns();
    const auto decoded = (*decoder)->decode(frame->message);
    const int64_t end_ns = now_ns();
    if (!decoded || largest_error_m(**decoded, snapshot) > kBoundM) {
      fmt::print(stderr, "{} {} frame {}: {}\n", scene, codec, i,
                 decoded ? "beyond the bound" : decoded.error().to_string());
      return false;
    }
    if (i < kStartFrames) continue;
    row.encode.add_ms(static_cast<double>(middle_ns - begin_ns) * 1e-6);
    row.decode.add_ms(static_cast<double>(end_ns - middle_ns) * 1e-6);
    row.bytes += static_cast<double>(frame->message.size());
  }
  const EncodedFramePtr keyframe =
      (*encoder)->encode_for_join(on_lattice(recording.states.back(), quantum_m)).keyframe;
  row.keyframe_bytes = static_cast<double>(keyframe->message.size());
  print(scene, codec.c_str(), row, recording.states[0].plane_size(), frames);
  return true;
}

void run_raw_zstd(const char* scene, const Recording& recording) {
  Row row;
  for (const Snapshot& state : recording.states) {
    const Snapshot snapshot = on_lattice(state, quantum_for_bound(kBoundM));
    const size_t source_bytes = snapshot.lattice.size() * sizeof(int32_t);
    std::vector<std::byte> packed(ZSTD_compressBound(source_bytes));
    std::vector<std::byte> unpacked(source_bytes);
    const int64_t begin_ns = now_ns();
    const size_t size = ZSTD_compress(packed.data(), packed.size(), snapshot.lattice.data(), source_bytes, 3);
    const int64_t middle_ns = now_ns();
    ZSTD_decompress(unpacked.data(), unpacked.size(), packed.data(), size);
    row.decode.add_ms(static_cast<double>(now_ns() - middle_ns) * 1e-6);
    row.encode.add_ms(static_cast<double>(middle_ns - begin_ns) * 1e-6);
    row.bytes += static_cast<double>(size);
  }
  const auto frames = static_cast<int>(recording.states.size());
  row.keyframe_bytes = row.bytes / frames;
  print(scene, "raw+zstd3", row, recording.states[0].plane_size(), frames);
}

struct Scene {
  std::string name;
  std::function<Result<Recording>(const RecordedSpan&)> record;
};

std::vector<Scene> test_scenes() {
  std::vector<Scene> scenes;
  scenes.push_back({"built_in_2000x16", [](const RecordedSpan& part) {
                      return record_simulation({"dftl", 2000, 16, {}, 0.0}, part);
                    }});
  const auto add = [&scenes](std::string name, const HairMotionDesc& desc) {
    scenes.push_back({std::move(name), [desc](const RecordedSpan& part) -> Result<Recording> {
                        return record_chains(desc, part);
                      }});
  };
  add("242x8_active", {242, 8, MotionKind::Active});
  for (const uint32_t strands : {2000u, 10000u}) {
    add(fmt::format("{}x16_idle", strands), {strands, 16, MotionKind::Idle});
    add(fmt::format("{}x16_active", strands), {strands, 16, MotionKind::Active});
    add(fmt::format("{}x16_extreme", strands), {strands, 16, MotionKind::Extreme});
  }
  return scenes;
}

/// Our own models on motion capture; clips by their names in the collections they come from.
std::vector<Scene> mocap_scenes(const std::filesystem::path& folder) {
  struct Part {
    const char* name;
    const char* file;
    double begin_s;
  };
  constexpr std::array kParts = {
      Part{"stand", "cmu_05_20_mb.bvh", 0.0},      // 0.15 m/s, up to 70 degrees/s
      Part{"walk", "cmu_131_01.bvh", 1.0},         // 1.2 m/s with turns of 380 degrees/s
      Part{"spin", "cmu_61_05_scaled.bvh", 8.0}};  // salsa: 1.9 m/s, 1,900 degrees/s
  std::vector<Scene> scenes;
  for (const Part& part : kParts) {
    const std::filesystem::path file = folder / part.file;
    if (!std::filesystem::exists(file)) {
      fmt::print(stderr, "no mocap_{}: {} is not there (--mocap DIR names the folder)\n", part.name,
                 file.string());
      continue;
    }
    for (const auto& [strands, vertices] : {std::pair(10000u, 16u), std::pair(2228u, 32u)}) {
      for (const char* solver : {"dftl", "direct_rod"}) {
        const SimulatedMotion motion{solver, strands, vertices, file, part.begin_s};
        scenes.push_back({fmt::format("mocap_{}_{}_{}x{}", part.name, solver, strands, vertices),
                          [motion](const RecordedSpan& of) { return record_simulation(motion, of); }});
      }
    }
  }
  return scenes;
}

struct Options {
  int frames = 120;
  std::string wanted;  // part of a scene's name
  std::filesystem::path mocap = "../shared/data/mocap";
};

int run(const Options& options) {
  std::vector<Scene> scenes = test_scenes();
  for (Scene& scene : mocap_scenes(options.mocap)) scenes.push_back(std::move(scene));
  fmt::print(
      "scene,codec,vertices,bits_per_vertex,mbit_per_s_at_60hz,keyframe_bits_per_vertex,encode_ms,decode_"
      "ms\n");
  for (const Scene& scene : scenes) {
    if (scene.name.find(options.wanted) == std::string::npos) continue;
    const auto recording = scene.record({kWarmUpFrames, kStartFrames + options.frames + 1});
    if (!recording) {
      fmt::print(stderr, "{}: {}\n", scene.name, recording.error().to_string());
      return 1;
    }
    for (const StrandCodecInfo& codec : strand_codecs())
      if (!run_codec(scene.name.c_str(), codec.name, *recording)) return 1;
    run_raw_zstd(scene.name.c_str(), *recording);
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  strandcast::Options options;
  int place = 0;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--mocap" && i + 1 < argc)
      options.mocap = argv[++i];
    else if (place++ == 0)
      options.frames = std::clamp(std::atoi(argv[i]), 1, 1000);
    else
      options.wanted = word;
  }
  return strandcast::run(options);
}
