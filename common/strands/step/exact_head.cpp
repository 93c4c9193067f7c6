#include "common/strands/step/exact_head.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/kernels/step_model.h"

namespace strandcast::step {
namespace {

constexpr size_t kRotationAt = 3;  // in steps of a pose
constexpr uint8_t kTickMask = 15;
constexpr uint8_t kWholePose = 16;  // no point of the lattice, or with nothing to count from

// Sums and differences wrap around.
int64_t sum(int64_t a, int64_t b) {
  return static_cast<int64_t>(static_cast<uint64_t>(a) + static_cast<uint64_t>(b));
}
int64_t difference(int64_t a, int64_t b) {
  return static_cast<int64_t>(static_cast<uint64_t>(a) - static_cast<uint64_t>(b));
}
uint64_t fold(int64_t value) {
  return (static_cast<uint64_t>(value) << 1) ^ static_cast<uint64_t>(value >> 63);
}
int64_t unfold(uint64_t folded) {
  return static_cast<int64_t>((folded >> 1) ^ (0 - (folded & 1)));
}

template <class AnyPose, class Visit>
void for_numbers(AnyPose& pose, Visit visit) {
  for (auto* number : {&pose.position_m.x, &pose.position_m.y, &pose.position_m.z, &pose.rotation.w,
                       &pose.rotation.x, &pose.rotation.y, &pose.rotation.z})
    visit(*number);
}

}  // namespace

void HeadBase::follow(const SnapshotInfo& frame, bool is_joint) {
  const PoseSteps before = pose_;
  pose_ = pose_steps(frame.world_from_head).value_or(PoseSteps{});
  for (size_t i = 0; i < pose_.size(); ++i) way_[i] = is_joint ? 0 : difference(pose_[i], before[i]);
  last_ = frame;
  last_.trail = nullptr;
}

/// Visits steps with what is expected of each. The longest part of the rotation comes last, since it follows
/// from the others.
template <class Code>
void HeadBase::code_pose(PoseSteps& steps, Code code) const {
  const auto is_less = [](int64_t a, int64_t b) { return std::abs(a) < std::abs(b); };
  const auto longest = static_cast<size_t>(
      std::max_element(pose_.begin() + kRotationAt, pose_.end(), is_less) - pose_.begin());
  double squared = 0.0;  // of the other parts
  for (size_t i = 0; i < steps.size(); ++i) {
    if (i == longest) continue;
    code(steps[i], sum(pose_[i], way_[i]));
    const double part = static_cast<double>(steps[i]) / kPoseStepsPerUnit;
    if (i >= kRotationAt) squared += part * part;
  }
  const double length = std::sqrt(std::max(0.0, 1.0 - squared)) * kPoseStepsPerUnit;
  code(steps[longest], static_cast<int64_t>(std::nearbyint(pose_[longest] < 0 ? -length : length)));
}

int64_t HeadBase::expected_motion_ns(int64_t sim_time_ns) const {
  const bool is_known = last_.motion_time_ns != 0;
  return is_known ? sum(last_.motion_time_ns, difference(sim_time_ns, last_.sim_time_ns)) : 0;
}

void HeadBase::write(const SnapshotInfo& frame, std::vector<std::byte>& bytes) const {
  ByteWriter to(bytes);
  std::optional<PoseSteps> steps = pose_steps(frame.world_from_head);
  const auto ticks = static_cast<uint8_t>(frame.tick - last_.tick);
  to.put(static_cast<uint8_t>(ticks | (steps ? 0 : kWholePose)));
  if (steps) {
    code_pose(*steps,
              [&](int64_t step, int64_t expected) { to.put_varint(fold(difference(step, expected))); });
  } else {
    for_numbers(frame.world_from_head, [&](double number) { to.put(number); });
  }
  to.put_varint(fold(difference(frame.motion_time_ns, expected_motion_ns(frame.sim_time_ns))));
}

Status HeadBase::read(ByteReader& bytes, StrandMessage& message) const {
  StrandFixedPart& fixed = message.fixed;
  const auto first = bytes.take<uint8_t>();
  const uint64_t ticks = first & kTickMask;
  if (first > (kTickMask | kWholePose) || ticks > kMostTrailTicks)
    return make_error(ErrorCode::BadInput, "an exact frame begins with {}, of {} ticks", first, ticks);
  fixed.tick = last_.tick + ticks;
  fixed.quantum_m = last_.quantum_m;
  fixed.strand_count = last_.strand_count;
  fixed.vertex_count = last_.vertex_count;
  if ((first & kWholePose) != 0) {
    for_numbers(fixed.world_from_head, [&](double& number) { number = bytes.take<double>(); });
  } else {
    PoseSteps steps{};
    code_pose(steps, [&](int64_t& step, int64_t expected) {
      step = sum(expected, unfold(bytes.take_varint<uint64_t>()));
    });
    fixed.world_from_head = pose_of(steps);
  }
  fixed.motion_time_ns =
      sum(expected_motion_ns(message.header.sim_time_ns), unfold(bytes.take_varint<uint64_t>()));
  if (!bytes.ok()) return make_error(ErrorCode::BadInput, "the head of an exact frame is cut off");
  return {};
}

}  // namespace strandcast::step
