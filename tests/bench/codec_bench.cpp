// Prints bits per vertex and milliseconds of the strand codecs, and of raw lattices under zstd in the same
// run, for test motions and for the built-in scene under its reference solver. Usage: codec_bench [frames
// [part of a scene's name]]
#include <fmt/format.h>
#include <zstd.h>

#include <cstdlib>
#include <functional>
#include <string_view>

#include "common/base/check.h"
#include "common/base/profile.h"
#include "common/codec/scene_asset.h"
#include "common/codec/strand_codec.h"
#include "common/motion/motion_clip.h"
#include "common/scene/features.h"
#include "server/publish/publisher.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"
#include "server/sim/solver_registry.h"
#include "tests/support/hair_motion.h"

namespace strandcast {
namespace {

constexpr float kBoundM = 1e-4f;
constexpr int kWarmUpFrames = 60;
constexpr double kRateHz = 60.0;

/// A motion that starts anew with every source, published on a lattice of the given step.
struct Source {
  std::vector<glm::vec3> rest_in_head_m;
  std::function<Snapshot()> next;
};

Source test_motion(const HairMotionDesc& desc, float quantum_m) {
  auto hair = std::make_shared<HairMotion>(desc);
  return {hair->rest_in_head(), [hair, quantum_m] {
            hair->step();
            return hair->snapshot(quantum_m);
          }};
}

/// The built-in scene as the server runs it, on the CPU: head motion, gusts, DFTL, publishing.
class BuiltInScene {
 public:
  explicit BuiltInScene(float quantum_m)
      : scene_(built_in_scene()),
        content_(std::move(load_scene_content(scene_)).value()),
        builder_(scene_, content_.colliders),
        publisher_(content_.groom, quantum_m) {
    const auto row = find_solver(scene_.solver.name);
    CHECK(row.ok());
    solver_ = (*row)->make_reference(complete_parameters(**row, scene_.solver.parameters).value());
    CHECK(solver_->load(content_.groom, built_in_motion(0.0).rotation).ok());
  }
  std::vector<glm::vec3> rest_in_head() const { return make_scene_asset(content_.groom, {}).rest_position_m; }
  Snapshot next() {
    ++tick_;
    const double time_s = static_cast<double>(tick_) / scene_.step_rate_hz;
    InputFrame input;
    input.has_motion = true;
    input.is_motion_stale = false;
    input.world_from_head = built_in_motion(time_s);
    const SceneStep& step = builder_.build(input, analyse(scene_, {}), time_s);
    for (const StepInput& substep : step.substeps) solver_->substep(substep);
    PublishInput publish;
    publish.tick = tick_;
    publish.sim_time_ns = std::llround(time_s * 1e9);
    publish.world_from_head = step.world_from_head;
    return *publisher_.publish(*solver_, publish);
  }

 private:
  SceneDesc scene_;
  SceneContent content_;
  StepBuilder builder_;
  Publisher publisher_;
  std::unique_ptr<Solver> solver_;
  uint64_t tick_ = 0;
};

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

bool run_codec(const char* scene, const std::string& codec, const Source& source, int frames) {
  Snapshot snapshot;
  for (int i = 0; i < kWarmUpFrames; ++i) snapshot = source.next();
  auto encoder = make_strand_encoder(codec);
  auto decoder = make_strand_decoder(codec, {snapshot.strand_count, snapshot.vertex_count});
  if (!encoder || !decoder) return false;
  (*encoder)->set_rest_shape(source.rest_in_head_m);
  (*decoder)->set_rest_shape(source.rest_in_head_m);
  Row row;
  constexpr int kStartFrames = 9;  // the first differences are not yet typical
  for (int i = -kStartFrames; i < frames; ++i) {
    snapshot = source.next();
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
    if (i < 0) continue;
    row.encode.add_ms(static_cast<double>(middle_ns - begin_ns) * 1e-6);
    row.decode.add_ms(static_cast<double>(end_ns - middle_ns) * 1e-6);
    row.bytes += static_cast<double>(frame->message.size());
  }
  row.keyframe_bytes =
      static_cast<double>((*encoder)->encode_for_join(source.next()).keyframe->message.size());
  print(scene, codec.c_str(), row, snapshot.plane_size(), frames);
  return true;
}

void run_raw_zstd(const char* scene, const Source& source, int frames) {
  Snapshot snapshot;
  for (int i = 0; i < kWarmUpFrames; ++i) snapshot = source.next();
  Row row;
  for (int i = 0; i < frames; ++i) {
    snapshot = source.next();
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
  print(scene, "raw+zstd3", row, snapshot.plane_size(), frames);
}

int run(int frames, std::string_view wanted) {
  struct Scene {
    const char* name;
    std::function<Source(float quantum_m)> start;
  };
  const auto motion = [](uint32_t strands, uint32_t vertices, MotionKind kind) {
    return [=](float quantum_m) { return test_motion({strands, vertices, kind}, quantum_m); };
  };
  const auto built_in = [](float quantum_m) {
    auto scene = std::make_shared<BuiltInScene>(quantum_m);
    return Source{scene->rest_in_head(), [scene] { return scene->next(); }};
  };
  const std::vector<Scene> scenes = {
      {"built_in_2000x16", built_in},
      {"242x8_active", motion(242, 8, MotionKind::Active)},
      {"2000x16_idle", motion(2000, 16, MotionKind::Idle)},
      {"2000x16_active", motion(2000, 16, MotionKind::Active)},
      {"2000x16_extreme", motion(2000, 16, MotionKind::Extreme)},
      {"10000x16_idle", motion(10000, 16, MotionKind::Idle)},
      {"10000x16_active", motion(10000, 16, MotionKind::Active)},
      {"10000x16_extreme", motion(10000, 16, MotionKind::Extreme)},
  };
  fmt::print(
      "scene,codec,vertices,bits_per_vertex,mbit_per_s_at_60hz,keyframe_bits_per_vertex,encode_ms,decode_"
      "ms\n");
  for (const Scene& scene : scenes) {
    if (std::string_view(scene.name).find(wanted) == std::string_view::npos) continue;
    for (const StrandCodecInfo& codec : strand_codecs())
      if (!run_codec(scene.name, codec.name, scene.start(lattice_step_m(codec.name, kBoundM).value()),
                     frames))
        return 1;
    run_raw_zstd(scene.name, scene.start(quantum_for_bound(kBoundM)), frames);
  }
  return 0;
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  constexpr int kDefaultFrames = 120;
  const int frames = argc > 1 ? std::atoi(argv[1]) : kDefaultFrames;
  return strandcast::run(frames > 0 ? frames : kDefaultFrames, argc > 2 ? argv[2] : "");
}
