// What an exact frame says of head and time: every bit comes back, in a few bytes, and nothing else is taken.
#include "common/strands/step/exact_head.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/stepped_hair.h"

namespace strandcast::exact_head_test {
namespace {

constexpr int64_t kFrameNs = 16'666'667;
constexpr size_t kWholePoseBytes = 7 * sizeof(double);

SnapshotInfo walking_frame(uint64_t frame) {
  SnapshotInfo info;
  info.tick = 100 + frame;
  info.sim_time_ns = static_cast<int64_t>(info.tick) * kFrameNs;
  const auto jitter_ns = static_cast<int64_t>(frame * 7919 % 4'000'000);
  info.motion_time_ns = 123'456'789'012 + info.sim_time_ns + jitter_ns;
  info.world_from_head = rounded_pose(walking_head(static_cast<double>(frame) / 60.0));
  info.strand_count = 3;
  info.vertex_count = 2;
  info.quantum_m = 0x1p-20f;
  return info;
}

std::vector<std::byte> written(const step::HeadBase& base, const SnapshotInfo& frame) {
  std::vector<std::byte> bytes;
  base.write(frame, bytes);
  return bytes;
}

/// What a decoder reads of a frame at this time.
Status read(const step::HeadBase& base, std::span<const std::byte> bytes, int64_t sim_time_ns,
            StrandMessage& message) {
  message = {};
  message.header.sim_time_ns = sim_time_ns;
  ByteReader reader(bytes);
  RETURN_IF_ERROR(base.read(reader, message));
  EXPECT_TRUE(reader.rest().empty());
  return check_numbers(message);
}

void expect_same(const SnapshotInfo& frame, const StrandMessage& message) {
  const StrandFixedPart& fixed = message.fixed;
  EXPECT_EQ(fixed.tick, frame.tick);
  EXPECT_EQ(fixed.motion_time_ns, frame.motion_time_ns);
  EXPECT_EQ(fixed.quantum_m, frame.quantum_m);
  EXPECT_EQ(fixed.strand_count, frame.strand_count);
  EXPECT_EQ(fixed.vertex_count, frame.vertex_count);
  EXPECT_EQ(info_hash(make_snapshot(message)), info_hash(frame));
}

TEST(ExactHead, GivesBackEveryBitInFewBytes) {
  constexpr size_t kMostBytes = 1 + 6 * 4 + 1 + 4;  // of a walk: six parts, one that follows, the time
  step::HeadBase base;
  base.follow(walking_frame(0), true);
  StrandMessage message;
  for (uint64_t i = 1; i < 200; ++i) {
    const SnapshotInfo frame = walking_frame(i);
    const std::vector<std::byte> bytes = written(base, frame);
    ASSERT_TRUE(read(base, bytes, frame.sim_time_ns, message));
    expect_same(frame, message);
    EXPECT_LE(bytes.size(), kMostBytes + (i == 1 ? 4 : 0)) << i;  // at first the head's speed is not known
    base.follow(frame, false);
  }
}

TEST(ExactHead, TellsAPoseBesideTheLatticeAsItIs) {
  step::HeadBase base;
  base.follow(walking_frame(0), true);
  SnapshotInfo frame = walking_frame(1);
  frame.world_from_head = walking_head(0.1);
  ASSERT_FALSE(pose_steps(frame.world_from_head));
  frame.tick += kMostTrailTicks - 1;
  frame.motion_time_ns = 0;
  StrandMessage message;
  std::vector<std::byte> bytes = written(base, frame);
  EXPECT_GT(bytes.size(), kWholePoseBytes);
  ASSERT_TRUE(read(base, bytes, frame.sim_time_ns, message));
  expect_same(frame, message);
  // The next one counts from none, and then from none there was.
  base.follow(frame, false);
  const SnapshotInfo next = walking_frame(10);
  ASSERT_TRUE(read(base, written(base, next), next.sim_time_ns, message));
  expect_same(next, message);
}

TEST(ExactHead, MinusZeroIsNotZero) {
  Pose pose;
  EXPECT_TRUE(pose_steps(pose));
  pose.position_m.x = -0.0;
  EXPECT_FALSE(pose_steps(pose));
  EXPECT_TRUE(pose_steps(rounded_pose(pose)));
  pose.position_m.x = std::nan("");
  EXPECT_FALSE(pose_steps(pose));
  EXPECT_TRUE(std::isnan(rounded_pose(pose).position_m.x));
}

TEST(ExactHead, RefusesWhatNoFrameCanBe) {
  step::HeadBase base;
  base.follow(walking_frame(0), true);
  const SnapshotInfo frame = walking_frame(1);
  const std::vector<std::byte> good = written(base, frame);
  StrandMessage message;
  const auto is_refused = [&](const std::vector<std::byte>& bytes) {
    return !read(base, bytes, frame.sim_time_ns, message);
  };
  EXPECT_FALSE(is_refused(good));
  for (size_t size = 0; size < good.size(); ++size)
    EXPECT_TRUE(is_refused({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)})) << size;
  for (const int first : {9, 15, 32, 64, 255}) {
    std::vector<std::byte> bytes = good;
    bytes[0] = static_cast<std::byte>(first);
    EXPECT_TRUE(is_refused(bytes)) << first;
  }
  // A number that goes on for longer than it is, or than 64 bits are.
  for (const size_t length : {1, 9, 20}) {
    std::vector<std::byte> bytes = {good[0]};
    bytes.insert(bytes.end(), length, std::byte{0x80});
    bytes.push_back(length == 1 ? std::byte{0} : std::byte{2});
    bytes.insert(bytes.end(), 7, std::byte{0});
    EXPECT_TRUE(is_refused(bytes)) << length;
  }
  // A head beyond the world, and a rotation that is none: the longest part of this one comes last.
  for (const size_t number : {0, 3, 6}) {
    std::vector<std::byte> bytes = {good[0]};
    bytes.insert(bytes.end(), number, std::byte{0});
    for (int i = 0; i < 9; ++i) bytes.push_back(std::byte{0xfe});
    bytes.push_back(std::byte{1});
    bytes.insert(bytes.end(), 7 - number, std::byte{0});
    EXPECT_TRUE(is_refused(bytes)) << number;
  }
  SnapshotInfo nowhere = frame;
  for (const double value : {std::nan(""), std::numeric_limits<double>::infinity(), 2e9}) {
    nowhere.world_from_head.position_m.y = value;
    EXPECT_TRUE(is_refused(written(base, nowhere))) << value;
  }
  SnapshotInfo late = frame;
  late.motion_time_ns = std::numeric_limits<int64_t>::max();
  EXPECT_TRUE(is_refused(written(base, late)));
}

}  // namespace
}  // namespace strandcast::exact_head_test
