#include <cmath>
#include <limits>
#include <random>

#include "common/strands/frame_header.h"
#include "common/strands/snapshot.h"

namespace strandcast::snapshot_test {
namespace {

std::vector<glm::vec3> random_points(size_t count, float reach_m, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> along(-reach_m, reach_m);
  std::vector<glm::vec3> points(count);
  for (auto& point : points) point = {along(random), along(random), along(random)};
  return points;
}

QuantiseInput input_for(const std::vector<glm::vec3>& points, float quantum_m) {
  QuantiseInput input;
  input.strand_count = static_cast<uint32_t>(points.size() / 4);
  input.vertex_count = 4;
  input.quantum_m = quantum_m;
  input.position_in_head_m = points;
  return input;
}

TEST(Snapshot, StaysWithinTheEuclideanBoundForEveryVertex) {
  for (const float bound_m : {2e-5f, 1e-4f, 5e-4f}) {
    for (const float reach_m : {0.01f, 0.3f, kBoundReachM}) {
      const auto points = random_points(40'000, reach_m, 3);
      const auto decoded =
          positions_in_head(quantise(input_for(points, quantum_for_bound(bound_m))).snapshot);
      double worst_m = 0.0;
      for (size_t i = 0; i < points.size(); ++i)
        worst_m = std::max(worst_m, glm::distance(glm::dvec3(points[i]), glm::dvec3(decoded[i])));
      EXPECT_LE(worst_m, static_cast<double>(bound_m)) << "reach " << reach_m;
      // Not wasteful either: 40,000 random points come close to the corner of a cell.
      EXPECT_GT(worst_m, 0.9 * bound_m) << "reach " << reach_m;
    }
  }
}

TEST(Snapshot, WorstCornerOfACellStillMeetsTheBound) {
  const float bound_m = 1e-4f;
  const float quantum_m = quantum_for_bound(bound_m);
  for (int i = 0; i < 17'000; i += 7) {
    const float corner = static_cast<float>((i + 0.5) * static_cast<double>(quantum_m));
    if (corner > kBoundReachM) break;
    const std::vector<glm::vec3> points(4, glm::vec3(corner, -corner, corner));
    const auto decoded = positions_in_head(quantise(input_for(points, quantum_m)).snapshot);
    ASSERT_LE(glm::distance(glm::dvec3(points[0]), glm::dvec3(decoded[0])), static_cast<double>(bound_m))
        << corner;
  }
}

TEST(Snapshot, LatticePointsAreFixedPoints) {
  const auto points = random_points(4'000, 1.0f, 5);
  const Snapshot once = quantise(input_for(points, quantum_for_bound(1e-4f))).snapshot;
  const auto decoded = positions_in_head(once);
  EXPECT_EQ(quantise(input_for(decoded, once.quantum_m)).snapshot.lattice, once.lattice);
}

TEST(Snapshot, ReplacesAndCountsNonFiniteVertices) {
  auto points = random_points(8, 0.3f, 1);
  const auto fallback = random_points(8, 0.3f, 2);
  const auto original = points;
  points[2].y = std::numeric_limits<float>::quiet_NaN();
  points[5].x = std::numeric_limits<float>::infinity();
  auto input = input_for(points, 1e-4f);
  const Quantised zeroed = quantise(input);
  EXPECT_EQ(zeroed.replaced_count, 2u);
  EXPECT_EQ(positions_in_head(zeroed.snapshot)[2], glm::vec3(0.0f));
  input.fallback_m = fallback;
  const auto decoded = positions_in_head(quantise(input).snapshot);
  for (size_t i = 0; i < points.size(); ++i) {
    const glm::vec3 expected = i == 2 || i == 5 ? fallback[i] : original[i];
    EXPECT_LE(glm::distance(decoded[i], expected), 1e-4f) << i;
  }
}

TEST(Snapshot, ClampsPositionsBeyondTheLattice) {
  const std::vector<glm::vec3> points(4, glm::vec3(3e38f, -3e38f, 0.0f));
  const Snapshot snapshot = quantise(input_for(points, 1e-4f)).snapshot;
  EXPECT_EQ(snapshot.lattice[0], kMaxLattice - 1);
  EXPECT_EQ(snapshot.lattice[4], -(kMaxLattice - 1));
  EXPECT_EQ(snapshot.lattice[8], 0);
}

TEST(Snapshot, HashCoversEverythingButTheMotionTime) {
  const auto points = random_points(8, 0.3f, 1);
  const Snapshot snapshot = quantise(input_for(points, 1e-4f)).snapshot;
  const uint64_t hash = state_hash(snapshot);
  Snapshot changed = snapshot;
  changed.motion_time_ns = 5;
  EXPECT_EQ(state_hash(changed), hash);
  for (size_t i = 0; i < snapshot.lattice.size(); ++i) {
    changed = snapshot;
    changed.lattice[i] += 1;
    EXPECT_NE(state_hash(changed), hash) << i;
  }
  changed = snapshot, changed.tick += 1;
  EXPECT_NE(state_hash(changed), hash);
  changed = snapshot, changed.sim_time_ns += 1;
  EXPECT_NE(state_hash(changed), hash);
  changed = snapshot, changed.world_from_head.position_m.z += 1e-9;
  EXPECT_NE(state_hash(changed), hash);
  changed = snapshot, changed.world_from_head.rotation.x += 1e-9;
  EXPECT_NE(state_hash(changed), hash);
  changed = snapshot, changed.quantum_m *= 2.0f;
  EXPECT_NE(state_hash(changed), hash);
  changed = snapshot, std::swap(changed.strand_count, changed.vertex_count);
  EXPECT_NE(state_hash(changed), hash);
}

std::vector<std::byte> bytes_of(std::initializer_list<int> values) {
  std::vector<std::byte> bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

TEST(FrameHeader, HasTheDocumentedBytes) {
  FrameHeader header;
  header.opcode = Opcode::StrandDelta;
  header.flags = 0;
  header.stream_id = 0x0201;
  header.sequence = 0x06050403;
  header.base_sequence = 0x0a090807;
  header.payload_bytes = 3;
  header.sim_time_ns = 0x1716151413121110;
  header.send_time_ns = -2;
  auto message = bytes_of({0x21, 0x00, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09,
                           0x0a, 0x03, 0x00, 0x00, 0x00, 0x10, 0x11, 0x12, 0x13, 0x14, 0x15,
                           0x16, 0x17, 0xfe, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff});
  const auto packed = pack(header);
  EXPECT_EQ(std::vector<std::byte>(packed.begin(), packed.end()), message);
  message.resize(kFrameHeaderBytes + 3);
  const auto unpacked = unpack_frame_header(message);
  ASSERT_TRUE(unpacked) << unpacked.error().to_string();
  EXPECT_EQ(*unpacked, header);
}

TEST(FrameHeader, RefusesWrongLengthsAndOpcodes) {
  const std::vector<std::byte> payload(10, std::byte{1});
  FrameHeader header;
  header.opcode = Opcode::JpegFrame;
  const auto frame = make_encoded_frame(header, payload);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->header.payload_bytes, payload.size());
  ASSERT_TRUE(unpack_frame_header(frame->message));
  for (size_t size = 0; size < frame->message.size(); ++size)
    EXPECT_FALSE(unpack_frame_header(std::span(frame->message).first(size))) << size;
  auto longer = frame->message;
  longer.push_back(std::byte{0});
  EXPECT_FALSE(unpack_frame_header(longer));
  for (int opcode = 0; opcode < 256; ++opcode) {
    auto message = frame->message;
    message[0] = static_cast<std::byte>(opcode);
    const bool is_known =
        opcode == 0x10 || opcode == 0x20 || opcode == 0x21 || (opcode >= 0x30 && opcode <= 0x33);
    EXPECT_EQ(unpack_frame_header(message).ok(), is_known) << opcode;
  }
}

TEST(FrameHeader, PayloadLimitIsExact) {
  const std::vector<std::byte> payload(kMaxMediaPayloadBytes + 1);
  const auto frame = make_encoded_frame({}, std::span(payload).first(kMaxMediaPayloadBytes));
  ASSERT_TRUE(frame);
  EXPECT_TRUE(unpack_frame_header(frame->message));
  EXPECT_FALSE(make_encoded_frame({}, payload));
  FrameHeader header;
  header.payload_bytes = kMaxMediaPayloadBytes + 1;
  const auto packed = pack(header);
  EXPECT_EQ(unpack_frame_header(packed).error().code, ErrorCode::LimitExceeded);
}

}  // namespace
}  // namespace strandcast::snapshot_test
