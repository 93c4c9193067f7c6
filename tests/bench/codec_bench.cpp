// Prints bits per vertex and milliseconds of the strand codecs, and of raw lattices under zstd in the same
// run. Usage: codec_bench [frames]
#include <fmt/format.h>
#include <zstd.h>

#include <cstdlib>

#include "common/base/profile.h"
#include "common/codec/strand_codec.h"
#include "tests/support/hair_motion.h"

namespace strandcast {
namespace {

constexpr float kBoundM = 1e-4f;
constexpr int kWarmUpFrames = 60;
constexpr double kRateHz = 60.0;

struct Row {
  StageTimer encode;
  StageTimer decode;
  double bytes = 0.0;
  double keyframe_bytes = 0.0;
};

void print(const char* scene, const char* codec, const Row& row, const HairMotion& hair, int frames) {
  const double vertices = static_cast<double>(hair.plane_size());
  const double bits_per_vertex = 8.0 * row.bytes / frames / vertices;
  fmt::print("{},{},{},{:.2f},{:.2f},{:.2f},{:.3f},{:.3f}\n", scene, codec, hair.plane_size(),
             bits_per_vertex, bits_per_vertex * vertices * kRateHz * 1e-6,
             8.0 * row.keyframe_bytes / vertices, row.encode.median_ms(), row.decode.median_ms());
}

bool run_codec(const char* scene, const std::string& codec, const HairMotionDesc& desc, int frames) {
  HairMotion hair(desc);
  for (int i = 0; i < kWarmUpFrames; ++i) hair.step();
  auto encoder = make_strand_encoder(codec);
  auto decoder = make_strand_decoder(codec, {desc.strand_count, desc.vertex_count});
  if (!encoder || !decoder) return false;
  Row row;
  constexpr int kStartFrames = 9;  // the first differences are not yet typical
  for (int i = -kStartFrames; i < frames; ++i) {
    hair.step();
    const Snapshot snapshot = hair.snapshot(quantum_for_bound(kBoundM));
    const int64_t begin_ns = now_ns();
    const EncodedFramePtr frame = (*encoder)->encode(snapshot);
    const int64_t middle_ns = now_ns();
    const auto decoded = (*decoder)->decode(frame->message);
    const int64_t end_ns = now_ns();
    if (!decoded || (*decoded)->lattice != snapshot.lattice) {
      fmt::print(stderr, "{} {} frame {}: decoded state differs\n", scene, codec, i);
      return false;
    }
    if (i < 0) continue;
    row.encode.add_ms(static_cast<double>(middle_ns - begin_ns) * 1e-6);
    row.decode.add_ms(static_cast<double>(end_ns - middle_ns) * 1e-6);
    row.bytes += static_cast<double>(frame->message.size());
  }
  row.keyframe_bytes = static_cast<double>((*encoder)->encode_keyframe()->message.size());
  print(scene, codec.c_str(), row, hair, frames);
  return true;
}

void run_raw_zstd(const char* scene, const HairMotionDesc& desc, int frames) {
  HairMotion hair(desc);
  for (int i = 0; i < kWarmUpFrames; ++i) hair.step();
  Row row;
  for (int i = 0; i < frames; ++i) {
    hair.step();
    const Snapshot snapshot = hair.snapshot(quantum_for_bound(kBoundM));
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
  row.keyframe_bytes = row.bytes / frames;
  print(scene, "raw+zstd3", row, hair, frames);
}

int run(int frames) {
  struct Scene {
    const char* name;
    HairMotionDesc desc;
  };
  const std::vector<Scene> scenes = {
      {"242x8_active", {242, 8, MotionKind::Active}},
      {"2000x16_idle", {2000, 16, MotionKind::Idle}},
      {"2000x16_active", {2000, 16, MotionKind::Active}},
      {"2000x16_extreme", {2000, 16, MotionKind::Extreme}},
      {"10000x16_active", {10000, 16, MotionKind::Active}},
  };
  fmt::print(
      "scene,codec,vertices,bits_per_vertex,mbit_per_s_at_60hz,keyframe_bits_per_vertex,encode_ms,decode_"
      "ms\n");
  for (const Scene& scene : scenes) {
    for (const char* codec : {"raw", "delta"})
      if (!run_codec(scene.name, codec, scene.desc, frames)) return 1;
    run_raw_zstd(scene.name, scene.desc, frames);
  }
  return 0;
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  constexpr int kDefaultFrames = 120;
  const int frames = argc > 1 ? std::atoi(argv[1]) : kDefaultFrames;
  return strandcast::run(frames > 0 ? frames : kDefaultFrames);
}
