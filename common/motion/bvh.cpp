#include "common/motion/bvh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "common/base/check.h"
#include "common/base/file.h"
#include "common/base/file_kind.h"
#include "common/base/frame_rate.h"
#include "common/base/mercy.h"
#include "common/base/quantile.h"
#include "common/motion/bvh_body.h"
#include "common/motion/bvh_skeleton.h"
#include "common/motion/motion_glitches.h"
#include "common/motion/text_cursor.h"

namespace strandcast {
namespace {

constexpr glm::dvec3 kAxis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

// A first frame is a calibration pose when most of its rotations are almost zero, clearly more than one frame
// later, and the head then jumps much further than it usually moves.
constexpr double kTPoseAngleDeg = 1.0;
constexpr double kTPoseRestShare = 0.6;
constexpr double kTPoseRestDrop = 0.2;
constexpr double kTPoseStepRatio = 10.0;

/// The axis of a file that is up, or down.
struct Upward {
  int axis = 1;
  double sign = 1.0;
  bool operator==(const Upward&) const = default;

  double of(const glm::dvec3& v) const { return sign * v[axis]; }
  /// Returns the farthest reach along the other axes.
  double beside(const glm::dvec3& v) const {
    return std::max(std::abs(v[(axis + 1) % 3]), std::abs(v[(axis + 2) % 3]));
  }
  std::string name() const { return fmt::format("{}{}", sign > 0.0 ? '+' : '-', "XYZ"[axis]); }
};
constexpr std::array<Upward, 6> kUpwards = {{{1, 1.0}, {2, 1.0}, {1, -1.0}, {2, -1.0}, {0, 1.0}, {0, -1.0}}};

/// Where the head is from the hips with all rotations zero. What is not clear counts as +Y up.
Upward guess_up(const BvhPath& path) {
  glm::dvec3 head(0.0);
  for (size_t i = 1; i < path.size(); ++i) head += path[i]->offset;
  for (const Upward& up : kUpwards)
    if (up.of(head) > kUpClearly * up.beside(head)) return up;
  return {};
}

/// Axes of a file.
struct FileUp {
  Upward at_rest, in_motion;
  double facing_rad = 0.0;  // of the rest pose, once it is upright: from +Z towards +X
};

constexpr double kLeastLegShare = 0.1;  // of the height above the hips
// Legs that end at a knee: the hips stand so many times higher over the floor than their bones reach.
constexpr double kShortLegs = 1.2, kShortestLegs = 2.5;
// Hips of a person who stands, in heights of the body (Winter, Biomechanics and Motor Control of Human
// Movement, 4th ed., figure 4.1: the greater trochanter). Who sits, or is moved from the hips on, has them
// lower than so many times the bones above them.
constexpr double kHipsShare = 0.53, kLowestHips = 0.8;
constexpr double kLongestSpineBone = 0.4;  // of the way from the hips to the crown

/// Height of a body in file units, 0 for one without extent, and what was measured.
struct BodyHeight {
  double units = 0.0;
  std::string of;
};

/// Where a joint lies from the one above it: its positions in a row go before its OFFSET.
glm::dvec3 place_of(const BvhJoint& joint, std::span<const double> row) {
  glm::dvec3 place = joint.offset;
  for (size_t i = 0; i < joint.channels.size(); ++i)
    if (!joint.channels[i].is_rotation) place[joint.channels[i].axis] = row[joint.first_channel + i];
  return place;
}

/// Length of the first bone above the root that has one, 0 for none.
double first_bone(const BvhPath& path, std::span<const double> row) {
  for (size_t i = 1; i < path.size(); ++i)
    if (const double length = glm::length(place_of(*path[i], row)); length > 0.0) return length;
  return 0.0;
}

/// Body height, file units: the bones from the hips down to the lowest point and up to the highest one, as
/// long as they are; rest poses often spread the legs. Where the hips stand higher over the floor than these
/// legs reach, that counts. Of the performer's joints alone.
BodyHeight body_height(const BvhSkeleton& skeleton, uint32_t head, const FileUp& axes,
                       std::span<const double> first_row) {
  struct Reach {
    double height = 0.0;  // above the root with all rotations zero
    double bones = 0.0;   // length of the bones from the root
  };
  const auto grown = [&](const Reach& parent, const glm::dvec3& offset) {
    return Reach{parent.height + axes.at_rest.of(offset), parent.bones + glm::length(offset)};
  };
  std::vector<Reach> reach;
  double root_height = 0.0;
  for (const BvhJoint* const joint : path_to(skeleton, skeleton.top))
    root_height += axes.in_motion.of(place_of(*joint, first_row));
  for (const BvhJoint& joint : skeleton.joints) {
    const auto index = static_cast<uint32_t>(reach.size());
    const bool is_grown = index != skeleton.top && is_own(skeleton, index);
    reach.push_back(is_grown ? grown(reach[joint.parent], place_of(joint, first_row)) : Reach{});
  }
  const size_t joint_count = reach.size();
  for (const BvhEndSite& site : skeleton.end_sites) {
    CHECK(site.parent < joint_count);
    if (is_own(skeleton, site.parent)) reach.push_back(grown(reach[site.parent], site.offset));
  }
  const auto [lowest, highest] = std::minmax_element(
      reach.begin(), reach.end(), [](const Reach& a, const Reach& b) { return a.height < b.height; });
  const bool has_legs = lowest->height < -kLeastLegShare * highest->height;
  const bool are_legs_cut =
      root_height > kShortLegs * lowest->bones && root_height < kShortestLegs * lowest->bones;
  if (has_legs && !are_legs_cut) return {lowest->bones + highest->bones, "the bones from foot to crown"};
  // Of a body without legs the hips are as high as these would be long, where it stands. A root from which
  // the first bone is as long as legs stands on the floor.
  const bool is_standing = root_height >= kLowestHips * highest->bones;
  if (is_standing || first_bone(own_path(skeleton, head), first_row) >= kLongestSpineBone * highest->bones)
    return {std::max(root_height, 0.0) + highest->bones,
            "the height of the root and the bones from there to the crown"};
  constexpr double kBodies = 1.0 / (1.0 - kHipsShare);
  return {kBodies * highest->bones,
          fmt::format("{:.3g} times the bones from hips to crown (there are no legs)", kBodies)};
}

/// Sets the clip's unit to the one that makes a body of this height about as tall as people are.
void guess_unit(MotionClip& clip, const BodyHeight& height) {
  const double guess_m = kAssumedBodyHeightM / height.units;
  const auto is_near = [&](const LengthUnit& unit) { return std::abs(guess_m / unit.m - 1.0) <= kUnitSnap; };
  const auto is_of_child = [&](const LengthUnit& unit) {
    const double height_m = height.units * unit.m;
    return unit.is_common && height_m >= kSmallestBodyM && height_m <= kAssumedBodyHeightM;
  };
  const auto* unit = std::find_if(std::begin(kClipUnits), std::end(kClipUnits), is_near);
  if (unit == std::end(kClipUnits))
    unit = std::find_if(std::begin(kClipUnits), std::end(kClipUnits), is_of_child);
  if (unit != std::end(kClipUnits)) {
    clip.file_unit_m = unit->m;
    clip.unit_reason = fmt::format("one unit is taken as {:.4g} m: {}, {:.4g} units, are {:.2f} m in {}",
                                   unit->m, height.of, height.units, height.units * unit->m, unit->name);
    return;
  }
  clip.file_unit_m = guess_m;
  clip.unit_reason = fmt::format(
      "one unit is taken as {:.4g} m, which makes {}, {:.4g} units, {:g} m long: no usual unit is near",
      guess_m, height.of, height.units, kAssumedBodyHeightM);
}

/// Takes a stated unit, and doubts one that makes no body: a giant of 10 m and a puppet of 0.2 m may be
/// meant.
void take_unit(MotionClip& clip, const BodyHeight& height, double unit_m) {
  clip.file_unit_m = unit_m;
  constexpr double kLeastM = 0.2, kMostM = 10.0;
  const double height_m = height.units * unit_m;
  if (!(height.units > 0.0) || (height_m >= kLeastM && height_m <= kMostM)) return;
  MotionClip likely;
  guess_unit(likely, height);
  clip.unit_doubt =
      fmt::format("with the unit that is stated, {:g} m, {} are {:.4g} m, as of no body: {:.4g} m is likely",
                  unit_m, height.of, height_m, likely.file_unit_m);
}

/// Says that a head lies, or hangs, by the stated up axis.
void doubt_up(MotionClip& clip, const Upward& stated, const Upward& guessed) {
  constexpr double kMostRad = 1.0;  // of a head that is bent over
  constexpr glm::dvec3 kUp(0, 1, 0);
  glm::dvec3 sum(0.0);
  for (const Pose& pose : clip.world_from_head) sum += pose.rotation * kUp;
  const double off_rad = std::atan2(glm::length(glm::cross(sum, kUp)), glm::dot(sum, kUp));
  if (guessed != stated && off_rad > kMostRad)
    clip.up_doubt =
        fmt::format("with the up axis that is stated the head is {:.0f} degrees off upright: {} is likely",
                    glm::degrees(off_rad), guessed.name());
}

/// Pose of the last joint of the path in the file's axes and units.
Pose evaluate(const BvhPath& path, std::span<const double> row) {
  Pose pose;
  for (const BvhJoint* joint : path) {
    Pose local{joint->offset, {1, 0, 0, 0}};
    for (size_t i = 0; i < joint->channels.size(); ++i) {
      const BvhChannel& channel = joint->channels[i];
      const double value = row[joint->first_channel + i];
      if (channel.is_rotation)
        local.rotation = local.rotation * glm::angleAxis(glm::radians(value), kAxis[channel.axis]);
      else
        local.position_m[channel.axis] = value;
    }
    pose = {pose * local.position_m, glm::normalize(pose.rotation * local.rotation)};
  }
  return pose;
}

/// Share of the rotation channels within kTPoseAngleDeg of zero.
double share_at_rest(const BvhSkeleton& skeleton, std::span<const double> row) {
  uint32_t at_rest = 0, rotations = 0;
  for (const BvhJoint& joint : skeleton.joints) {
    for (size_t i = 0; i < joint.channels.size(); ++i) {
      if (!joint.channels[i].is_rotation) continue;
      ++rotations;
      if (std::abs(row[joint.first_channel + i]) < kTPoseAngleDeg) ++at_rest;
    }
  }
  return rotations ? static_cast<double>(at_rest) / rotations : 0.0;
}

struct MotionHeader {
  uint32_t frame_count = 0;
  double frame_s = 0.0;
};

/// `stated_s`: of a frame, where the file does not say it; 0 = nobody states it.
Result<MotionHeader> parse_motion_header(TextCursor& cursor, double stated_s) {
  MotionHeader header;
  if (!equals_ignoring_case(cursor.next_token(), "Frames:"))
    return cursor.fail(ErrorCode::BadInput, "expected \"Frames:\" after MOTION");
  const auto frames = parse_number(cursor.next_token());
  if (!frames || *frames < 1 || *frames != std::floor(*frames))
    return cursor.fail(ErrorCode::BadInput, "Frames must be a whole number of at least 1");
  if (*frames > kMaxBvhFrames)
    return cursor.fail(ErrorCode::LimitExceeded, "{:g} frames, the limit is {}", *frames, kMaxBvhFrames);
  header.frame_count = static_cast<uint32_t>(*frames);
  if (!equals_ignoring_case(cursor.next_token(), "Frame") ||
      !equals_ignoring_case(cursor.next_token(), "Time:"))
    return cursor.fail(ErrorCode::BadInput, "expected \"Frame Time:\" after Frames");
  const auto word = cursor.next_token();
  const auto frame_s = bvh_number(word);
  const bool is_fit = frame_s && *frame_s >= kMinFrameTimeS && *frame_s <= kMaxFrameTimeS;
  if (!is_fit && stated_s == 0.0)
    return cursor.fail(
        ErrorCode::BadInput,
        "frame time is \"{}\", it must be within {} .. {} s (--fps states the rate, --motion-fps "
        "that of bake)",
        shown(word), kMinFrameTimeS, kMaxFrameTimeS);
  header.frame_s = is_fit ? exact_frame_s(*frame_s) : stated_s;
  return header;
}

/// `idle` counts values that are no numbers where others can stand in.
Status parse_row(const TextCursor& cursor, std::string_view rest, size_t frame,
                 std::span<const std::optional<double>> instead, std::span<double> row, BadItems& idle) {
  for (size_t i = 0; i < row.size(); ++i) {
    const auto word = take_token(rest);
    if (word.empty())
      return cursor.fail(ErrorCode::BadInput, "frame {} has {} values, the hierarchy has {} channels", frame,
                         i, row.size());
    const auto value = bvh_number(word);
    if (!value) {
      Error problem =
          cursor.fail(ErrorCode::BadInput, "value {} of frame {} is \"{}\", not a number within 1e9", i,
                      frame, shown(word));
      if (!instead[i]) return problem;
      idle.add(std::move(problem));
    }
    row[i] = value ? *value : *instead[i];
  }
  if (!trim(rest).empty())
    return cursor.fail(ErrorCode::BadInput, "frame {} has more values than the {} channels of the hierarchy",
                       frame, row.size());
  return {};
}

/// What the rows of a file say of the path to the head and of the body.
struct Rows {
  std::vector<uint8_t> is_good;        // of each; the pose of a bad one is none
  std::vector<double> first;           // the first good one
  std::array<double, 2> rest_share{};  // of the first two good ones
  glm::dvec3 lift{0.0};                // sums of good ones: from the root to the head, and the root's place
  glm::dvec3 root{0.0}, root_low{0.0}, root_high{0.0};
  BadItems bad;
  BadItems idle;  // values in channels that nobody uses
  uint64_t decimal_commas = 0;
};

/// Of each channel what stands in for a value that is no number: the rest pose's, nothing where a joint needs
/// it.
std::vector<std::optional<double>> stand_ins(const BvhSkeleton& skeleton, const BvhPath& head,
                                             const std::vector<BvhPath>& body) {
  std::vector<std::optional<double>> values;
  for (const BvhJoint& joint : skeleton.joints)
    for (const BvhChannel& channel : joint.channels)
      values.emplace_back(channel.is_rotation ? 0.0 : joint.offset[channel.axis]);
  const auto need = [&](const BvhPath& path) {
    for (const BvhJoint* const joint : path)
      std::fill_n(values.begin() + joint->first_channel, joint->channels.size(), std::nullopt);
  };
  need(head);
  for (const BvhPath& path : body) need(path);
  return values;
}

/// Reads rows up to the end of the text, each one of `clip`.
Result<Rows> read_rows(TextCursor& cursor, const BvhSkeleton& skeleton, const BvhPath& head,
                       const std::vector<BvhPath>& body, MotionClip& clip) {
  Rows rows;
  std::vector<double> row(skeleton.channel_count);
  const auto instead = stand_ins(skeleton, head, body);
  const BvhPath to_top = path_to(skeleton, skeleton.top);
  size_t good_count = 0;
  while (const auto line = cursor.next_line()) {
    const size_t frame = rows.is_good.size();
    if (frame == kMaxBvhFrames)
      return cursor.fail(ErrorCode::LimitExceeded, "more than {} frames", kMaxBvhFrames);
    const Status read = parse_row(cursor, *line, frame, instead, row, rows.idle);
    rows.is_good.push_back(read ? 1 : 0);
    if (!read) {
      rows.bad.add(read.error());
      clip.world_from_head.emplace_back();
      clip.joint_m.resize(clip.joint_m.size() + body.size());
      continue;
    }
    rows.decimal_commas += static_cast<uint64_t>(std::count(line->begin(), line->end(), ','));
    if (good_count == 0) rows.first = row;
    if (good_count < rows.rest_share.size()) rows.rest_share[good_count] = share_at_rest(skeleton, row);
    ++good_count;
    clip.world_from_head.push_back(evaluate(head, row));
    const Pose& at_frame = clip.world_from_head.back();
    const glm::dvec3 root = evaluate(to_top, row).position_m;
    rows.lift += at_frame.position_m - root;
    rows.root += root;
    rows.root_low = good_count == 1 ? root : glm::min(rows.root_low, root);
    rows.root_high = good_count == 1 ? root : glm::max(rows.root_high, root);
    for (const BvhPath& joint : body)
      clip.joint_m.push_back(glm::conjugate(at_frame.rotation) *
                             (evaluate(joint, row).position_m - at_frame.position_m));
  }
  if (rows.is_good.empty()) return cursor.fail(ErrorCode::BadInput, "the file ends before its first frame");
  RETURN_IF_ERROR(rows.bad.judge(rows.is_good.size(), "frames"));
  return rows;
}

/// Puts between good frames what lies between them; bad ones at the beginning and at the end go.
void bridge(MotionClip& clip, const std::vector<uint8_t>& is_good) {
  const size_t joint_count = clip.joint_name.size();
  const auto first = static_cast<size_t>(std::find(is_good.begin(), is_good.end(), 1) - is_good.begin());
  size_t good = first;
  for (size_t i = first; i < is_good.size(); ++i) {
    if (is_good[i] == 0) continue;
    for (size_t k = good + 1; k < i; ++k) {
      const double share = static_cast<double>(k - good) / static_cast<double>(i - good);
      clip.world_from_head[k] = interpolate(clip.world_from_head[good], clip.world_from_head[i], share);
      for (size_t joint = 0; joint < joint_count; ++joint)
        clip.joint_m[k * joint_count + joint] =
            glm::mix(clip.joint_m[good * joint_count + joint], clip.joint_m[i * joint_count + joint], share);
    }
    good = i;
  }
  clip.world_from_head.resize(good + 1);
  clip.joint_m.resize((good + 1) * joint_count);
  leave_out_first_frames(clip, static_cast<uint32_t>(first));
}

bool begins_with_t_pose(const std::vector<Pose>& poses, double rest_share_first, double rest_share_second) {
  if (poses.size() < 4 || rest_share_first < kTPoseRestShare ||
      rest_share_first < rest_share_second + kTPoseRestDrop)
    return false;
  std::vector<double> steps;
  for (size_t i = 1; i < poses.size(); ++i)
    steps.push_back(glm::distance(poses[i - 1].position_m, poses[i].position_m));
  const double first = steps.front();
  return first > kTPoseStepRatio * median(std::move(steps));
}

/// What is up in the motion, which need not be up at rest: who stands has the head above the hips, and these
/// above the floor, where they stay. Who crawls goes where the head is from the hips.
Upward guess_up_in_motion(const Rows& rows, const Upward& at_rest) {
  constexpr double kMostClimb = 1.5;  // times the way from hips to head
  const auto frames = static_cast<double>(rows.is_good.size() - rows.bad.count());
  const glm::dvec3 way = rows.root_high - rows.root_low;
  for (const Upward& up : kUpwards) {
    const bool goes_there =
        way[up.axis] * frames > kMostClimb * up.of(rows.lift) && way[up.axis] > way[at_rest.axis];
    if (up != at_rest && up.of(rows.lift) > kUpClearly * up.beside(rows.lift) &&
        up.of(rows.root) > 0.5 * up.of(rows.lift) && !goes_there)
      return up;
  }
  return at_rest;
}

FileUp guess_both(const BvhPath& path, const Rows& rows) {
  const Upward at_rest = guess_up(path);
  return {at_rest, guess_up_in_motion(rows, at_rest)};
}

/// Turns that side up, and leaves the face ahead: +Z, or -Y where Z is the axis.
glm::dquat upright_from(const Upward& up) {
  const glm::dquat turn = up.axis == 2   ? glm::angleAxis(glm::radians(-90.0), kAxis[0])
                          : up.axis == 0 ? glm::angleAxis(glm::radians(90.0), kAxis[2])
                                         : glm::dquat(1, 0, 0, 0);
  return up.sign > 0.0 ? turn : glm::dquat(0, 0, 0, 1) * turn;
}

/// Where left and right joints of the performer say that a rest pose looks, in quarter turns from +Z
/// towards +X; nothing where they say nothing.
std::optional<int> facing_at_rest(const BvhSkeleton& skeleton, const Upward& up,
                                  std::span<const double> first_row) {
  constexpr double kMostOff = 0.35;
  std::vector<glm::dvec3> places;
  std::vector<std::string> names;
  for (uint32_t i = 0; i < skeleton.joints.size(); ++i) {
    const BvhJoint& joint = skeleton.joints[i];
    names.push_back(is_own(skeleton, i) ? joint.name : std::string());
    places.push_back(place_of(joint, first_row) +
                     (joint.parent == kNoJoint ? glm::dvec3(0.0) : places[joint.parent]));
  }
  glm::dvec3 to_left(0.0);
  for (const auto& [left, right] : sided_pairs(names)) to_left += places[left] - places[right];
  if (!(glm::length(to_left) > 0.0)) return std::nullopt;
  to_left = upright_from(up) * glm::normalize(to_left);
  const double turns = std::atan2(-to_left.z, to_left.x) / glm::radians(90.0), whole = std::round(turns);
  if (std::abs(to_left.y) > kMostOff || std::abs(turns - whole) > kMostOff) return std::nullopt;
  return static_cast<int>(whole);
}

/// Takes the rest pose's facing, which is +Z of most, into the axes of a file.
void take_facing(MotionClip& clip, std::optional<int> quarters, FileUp& up) {
  constexpr std::array kNames = {"-Z", "-X", "+Z", "+X", "-Z"};
  if (quarters.value_or(0) != 0) {
    up.facing_rad = glm::radians(90.0 * *quarters);
    clip.facing_reason =
        fmt::format("its rest pose faces {}, once it is upright: its left and right joints lie so",
                    kNames[static_cast<size_t>(*quarters + 2)]);
  } else if (up.at_rest.axis == 0 && !quarters) {
    clip.up_reason += ", and its face is taken to be at +Z there (feed turns it ahead by the motion alone)";
  }
}

/// From the file's axes and units to world axes and metres.
void to_world(std::vector<Pose>& poses, double unit_m, const FileUp& up, bool recentre) {
  const glm::dquat world_from_file = upright_from(up.in_motion);
  const glm::dquat rest_from_upright =
      glm::conjugate(upright_from(up.at_rest)) * glm::angleAxis(up.facing_rad, kAxis[1]);
  for (Pose& pose : poses) {
    pose.position_m = world_from_file * (pose.position_m * unit_m);
    // On both sides: the file's rest pose is turned upright too, so that it becomes the identity.
    pose.rotation = glm::normalize(world_from_file * pose.rotation * rest_from_upright);
  }
  if (!recentre) return;
  const glm::dvec3 start = poses.front().position_m * glm::dvec3(1, 0, 1);
  for (Pose& pose : poses) pose.position_m -= start;
}

/// Likewise: seen from the head, whose rest pose is upright.
void to_head_space(std::vector<glm::dvec3>& places, double unit_m, const FileUp& up) {
  const glm::dquat upright = glm::angleAxis(-up.facing_rad, kAxis[1]) * upright_from(up.at_rest);
  for (glm::dvec3& place : places) place = upright * (place * unit_m);
}

/// Paths to the joints of the body that are known, and their names; NotFound for one that was asked for. Of
/// the performer; what is asked for may be another's.
Result<std::vector<BvhPath>> find_body(const BvhSkeleton& skeleton, const BvhOptions& options,
                                       std::vector<std::string>& names) {
  std::vector<std::string> in_file, of_head;
  for (uint32_t i = 0; i < skeleton.joints.size(); ++i) {
    in_file.push_back(skeleton.joints[i].name);
    of_head.push_back(is_own(skeleton, i) ? in_file.back() : std::string());
  }
  std::vector<BvhPath> paths;
  const auto add = [&](const std::string& name, size_t joint) {
    names.push_back(name);
    paths.push_back(path_to(skeleton, static_cast<uint32_t>(joint)));
  };
  if (options.has_body)
    for (const auto& [name, joint] : usual_body(of_head)) add(name, joint);
  for (const std::string& wanted : options.body_joints) {
    const bool is_there = std::find(of_head.begin(), of_head.end(), wanted) != of_head.end();
    const std::vector<std::string>& searched = is_there ? of_head : in_file;
    const auto found = std::find(searched.begin(), searched.end(), wanted);
    if (found == searched.end())
      return make_error(ErrorCode::NotFound, "no joint named {} (--body-joint, known: {})", shown(wanted),
                        known_joints(skeleton));
    if (std::find(names.begin(), names.end(), wanted) == names.end())
      add(wanted, static_cast<size_t>(found - searched.begin()));
  }
  if (names.size() > kMaxBodyJoints)
    return make_error(ErrorCode::LimitExceeded, "{} joints of the body, the limit is {}", names.size(),
                      kMaxBodyJoints);
  return paths;
}

std::vector<std::string> repairs_of(const Rows& rows, const MotionHeader& header) {
  std::vector<std::string> repairs;
  if (rows.bad.count() > 0)
    repairs.push_back(rows.bad.sentence(rows.is_good.size(), "frames", "and are bridged or left out"));
  if (rows.idle.count() > 0)
    repairs.push_back(fmt::format("{} values are no numbers, in joints that nobody needs; the first: {}",
                                  rows.idle.count(), rows.idle.first().to_string()));
  if (rows.decimal_commas > 0)
    repairs.push_back(
        counted(rows.decimal_commas, "number has a decimal comma", "numbers have a decimal comma"));
  if (rows.is_good.size() != header.frame_count)
    repairs.push_back(
        fmt::format("{} frames are announced, {} are there", header.frame_count, rows.is_good.size()));
  return repairs;
}

}  // namespace

Result<MotionClip> parse_bvh(const std::string& text, const std::string& place, const BvhOptions& options) {
  if (!(options.unit_m >= 0.0) || !std::isfinite(options.unit_m))
    return make_error(ErrorCode::BadInput, "the length unit is {} m, it must be above 0, or 0 to be guessed",
                      options.unit_m);
  TextCursor cursor(text, place);
  ASSIGN_OR_RETURN(BvhSkeleton skeleton, parse_bvh_skeleton(cursor));
  Result<uint32_t> head = find_head(skeleton, options.head_joint);
  if (!head) return at(place, head.error());
  ASSIGN_OR_RETURN(const MotionHeader header, parse_motion_header(cursor, options.frame_s));
  if (skeleton.channel_count == 0) return cursor.fail(ErrorCode::BadInput, "the hierarchy has no channels");

  static_cast<void>(cursor.rest_of_line());
  const uint32_t named_head = *head;
  if (options.head_joint.empty()) head = find_moving_head(cursor, skeleton, named_head);
  skeleton.top = find_top(skeleton, *head);
  const auto path = path_to(skeleton, *head);
  MotionClip clip;
  std::vector<BvhPath> body;
  if (options.has_body || !options.body_joints.empty()) {
    auto found = find_body(skeleton, options, clip.joint_name);
    if (!found) return at(place, found.error());
    body = std::move(found).value();
  }
  clip.frame_s = header.frame_s;
  ASSIGN_OR_RETURN(const Rows rows, read_rows(cursor, skeleton, path, body, clip));
  bridge(clip, rows.is_good);
  clip.repairs = repairs_of(rows, header);
  if (options.skip_first_frame_if_t_pose &&
      begins_with_t_pose(clip.world_from_head, rows.rest_share[0], rows.rest_share[1]))
    leave_out_first_frames(clip, 1);
  clip.head_reason = taken_head(skeleton, *head);
  if (*head != named_head) clip.head_reason += ": the first joint of such a name does not move";
  const Upward stated{options.is_z_up.value_or(false) ? 2 : 1};
  FileUp up = options.is_z_up ? FileUp{stated, stated} : guess_both(own_path(skeleton, *head), rows);
  clip.up = up.in_motion.name();
  if (up.at_rest != up.in_motion)
    clip.up_reason = fmt::format(
        "{} is taken as up: there the head is above the hips in the motion, though {} is up in the rest pose",
        up.in_motion.name(), up.at_rest.name());
  else if (up.at_rest != Upward{} && !options.is_z_up)
    clip.up_reason = fmt::format("{} is taken as up: there the head is above the hips in the rest pose",
                                 up.at_rest.name());
  take_facing(clip, facing_at_rest(skeleton, up.at_rest, rows.first), up);
  const BodyHeight height = body_height(skeleton, *head, up, rows.first);
  const bool is_guessed = options.unit_m == 0.0;
  if (is_guessed && !(height.units > 0.0))
    return at(place, make_error(ErrorCode::BadInput,
                                "the skeleton has no height to guess the unit from: give the unit"));
  if (is_guessed)
    guess_unit(clip, height);
  else
    take_unit(clip, height, options.unit_m);
  to_world(clip.world_from_head, clip.file_unit_m, up, options.recentre);
  if (options.is_z_up) doubt_up(clip, stated, guess_both(own_path(skeleton, *head), rows).in_motion);
  to_head_space(clip.joint_m, clip.file_unit_m, up);
  return clip;
}

Result<MotionClip> load_bvh(const std::filesystem::path& path, const BvhOptions& options) {
  ASSIGN_OR_RETURN(const std::string text, load_text(path, kMaxBvhFileBytes));
  Result<MotionClip> clip = parse_bvh(text, path.string(), options);
  const std::string kind = clip ? std::string() : likely_kind(path);
  if (kind.empty() || text.starts_with("HIERARCHY")) return clip;
  Error error = clip.error();
  error.message += "; " + kind;
  return error;
}

}  // namespace strandcast
