#include "tests/conformance/conformance_inputs.h"

#include "common/strands/strand_prefix.h"

namespace strandcast::conformance {
namespace {

constexpr uint32_t kSlicedStrands = 1024;  // slices, and with these vertices all classes of weights
constexpr uint32_t kSlicedVertices = 16;
constexpr uint32_t kShortStory = 3;  // frames
constexpr uint32_t kStory = 10;
constexpr uint32_t kNewBoundAt = 8;

// Of the lattice that the hair moves on. Codecs that give back the lattice they get have a coarser one.
constexpr float kFineStepM = 0x1p-21f;
constexpr int kCoarserBits = 8;

bool rounds_itself(const StreamCase& stream) {
  return stream.codec == "tangent";
}

/// 0, 1, .. 8, .. 0, .. -8, .. with the period 32.
int32_t zigzag(uint32_t t) {
  const auto phase = static_cast<int32_t>(t % 32);
  return phase < 8 ? phase : phase < 24 ? 16 - phase : phase - 32;
}

/// -20..20, alike for nobody near by.
int32_t tremble(uint32_t s, uint32_t v, uint32_t frame) {
  const uint32_t mixed = (s * 7919u + v * 104'729u + frame * 1'299'721u) * 2'654'435'761u;
  return static_cast<int32_t>((mixed >> 16) % 41) - 20;
}

glm::ivec3 root_of(uint32_t s) {
  const glm::ivec2 cell(static_cast<int32_t>(s % 32) - 16, static_cast<int32_t>(s / 32));
  const int32_t lower = 64 * (cell.x * cell.x + cell.y * cell.y);
  return {8192 * cell.x, 200'000 - lower, 8192 * cell.y};
}

/// From the vertex before vertex v, which is no root.
glm::ivec3 rest_edge_of(uint32_t s, uint32_t v) {
  return {1000 * zigzag(s + 3 * v), -38'000, 1200 * zigzag(5 * s + 7 * v + 9)};
}

glm::ivec3 rest_position_of(uint32_t s, uint32_t v) {
  glm::ivec3 position = root_of(s);
  for (uint32_t u = 1; u <= v; ++u) position += rest_edge_of(s, u);
  return position;
}

/// Strand 2 turns round for two frames: nothing foretells that.
bool is_turned_round(uint32_t s, uint32_t frame) {
  return s == 2 && (frame == 3 || frame == 4);
}

glm::ivec3 position_of(uint32_t s, uint32_t v, uint32_t frame) {
  glm::ivec3 edges(0);
  for (uint32_t u = 1; u <= v; ++u)
    edges += rest_edge_of(s, u) + glm::ivec3(40 * zigzag(frame + 2 * u + s % 7), 60 * zigzag(3 * frame + s),
                                             30 * zigzag(2 * frame + u + s % 3));
  if (is_turned_round(s, frame)) edges = -edges;
  return root_of(s) + edges + tremble(s, v, frame) * glm::ivec3(1, -1, 1);
}

/// Turns by 2 atan(1 / n), exact but for the divisions.
Pose head_pose(uint32_t frame) {
  const double n = 20.0 - frame;
  Pose pose;
  pose.position_m = {frame / 64.0, 1.5, frame / -128.0};
  pose.rotation = {(n * n - 1.0) / (n * n + 1.0), 0.0, 2.0 * n / (n * n + 1.0), 0.0};
  return pose;
}

Snapshot snapshot_of(const StreamCase& stream, uint32_t frame) {
  constexpr int64_t kFrameNs = 16'666'667;
  Snapshot snapshot;
  snapshot.tick = frame + 1;
  snapshot.sim_time_ns = kFrameNs * static_cast<int64_t>(snapshot.tick);
  snapshot.motion_time_ns = frame == 0 ? 0 : snapshot.sim_time_ns - 1'000'000;
  snapshot.world_from_head = head_pose(frame);
  snapshot.strand_count = stream.strand_count;
  snapshot.vertex_count = stream.vertex_count;
  const int shift = (rounds_itself(stream) ? 0 : kCoarserBits) + (frame >= kNewBoundAt ? 1 : 0);
  snapshot.quantum_m = kFineStepM * static_cast<float>(1 << shift);
  for (int axis = 0; axis < 3; ++axis)
    for (uint32_t v = 0; v < stream.vertex_count; ++v)
      for (uint32_t s = 0; s < stream.strand_count; ++s)
        snapshot.lattice.push_back(position_of(s, v, frame)[axis] >> shift);
  return snapshot;
}

}  // namespace

std::vector<StreamCase> stream_cases() {
  std::vector<StreamCase> cases;
  for (const char* codec : {"raw", "delta", "tangent"}) {
    cases.push_back({"whole", codec, 7, 5, 7});
    cases.push_back({"prefix", codec, 7, 5, 3});
  }
  cases.push_back({"no_rest", "tangent", 7, 5, 7, false});
  cases.push_back({"slices", "tangent", kSlicedStrands, kSlicedVertices, kSlicedStrands});
  return cases;
}

std::vector<StreamStep> steps_of(const StreamCase& stream) {
  std::vector<StreamStep> steps;
  const bool is_large = stream.strand_count == kSlicedStrands;
  for (uint32_t frame = 0; frame < (is_large ? kShortStory : kStory); ++frame)
    steps.push_back({prefix_of(snapshot_of(stream, frame), stream.coded_count),
                     is_large ? frame == 1 : frame == 4 || frame == 6});
  return steps;
}

std::vector<glm::vec3> rest_shape_of(const StreamCase& stream) {
  std::vector<glm::vec3> rest_in_head_m;
  if (!stream.has_rest) return rest_in_head_m;
  for (uint32_t v = 0; v < stream.vertex_count; ++v)
    for (uint32_t s = 0; s < stream.strand_count; ++s)
      rest_in_head_m.push_back(kFineStepM * glm::vec3(rest_position_of(s, v)));
  return rest_in_head_m;
}

}  // namespace strandcast::conformance
