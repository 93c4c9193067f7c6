// The state hash is computed from the words of proto/WIRE.md alone, and the worked example there is right.
#include "common/base/file.h"
#include "tests/conformance/reference_hash.h"

namespace strandcast::conformance::state_hash_test {
namespace {

/// The state of the example in section 6.
Snapshot example() {
  Snapshot snapshot;
  snapshot.tick = 7;
  snapshot.sim_time_ns = 116'666'669;
  snapshot.world_from_head.position_m = {0.5, -0.25, 2.0};
  snapshot.world_from_head.rotation = {0.8, 0.0, 0.6, 0.0};
  snapshot.strand_count = 1;
  snapshot.vertex_count = 3;
  snapshot.quantum_m = 0x1p-12f;
  snapshot.lattice = {1, 2, 3, -1, -2, -3, 100'000, -100'000, 0};
  return snapshot;
}

TEST(StateHash, IsWhatTheDocumentSays) {
  EXPECT_EQ(reference_state_hash(example()), state_hash(example()));
  // No part may be left out of it, and none added: the time of motion is not hashed.
  Snapshot other = example();
  other.motion_time_ns = 5;
  EXPECT_EQ(state_hash(other), state_hash(example()));
  other.lattice.back() = 1;
  EXPECT_NE(state_hash(other), state_hash(example()));
  EXPECT_EQ(reference_state_hash(other), state_hash(other));
}

TEST(StateHash, TheWorkedExampleOfTheDocumentIsRight) {
  const auto text = load_text(std::filesystem::path(STRANDCAST_SOURCE_DIR) / "proto/WIRE.md", 1 << 20);
  ASSERT_TRUE(text) << text.error().to_string();
  EXPECT_NE(text->find("0x100000001b3"), std::string::npos);
  constexpr size_t kPose = 2;
  ReferenceHash hash;
  uint64_t after_pose = 0;
  const auto parts = hashed_parts(example());
  for (size_t i = 0; i < parts.size(); ++i) {
    hash.add(parts[i]);
    if (i == kPose) after_pose = hash.value();
  }
  const std::string sentence =
      fmt::format("`{:016x}` after the pose, `{:016x}` in the end.", after_pose, hash.value());
  EXPECT_NE(text->find(sentence), std::string::npos) << "WIRE.md has not: " << sentence;
}

}  // namespace
}  // namespace strandcast::conformance::state_hash_test
