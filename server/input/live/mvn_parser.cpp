// Xsens MVN's network streamer, by its protocol specification, revision N: poses of segments as quaternions
// (MXTP02). A subject is a character's number. Other messages are ignored. The specification has centimetres,
// and some senders metres: the distance from pelvis to head says which.
#include <array>
#include <string_view>
#include <utility>

#include "common/scene/body_desc.h"
#include "server/input/live/big_endian_reader.h"
#include "server/input/live/conventions.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

constexpr std::string_view kMark = "MXTP";
constexpr std::string_view kQuaternions = "02", kEulerAngles = "01";
constexpr size_t kMvnHeaderBytes = 24, kMvnItemBytes = 32;
constexpr uint8_t kDatagramMask = 0x7F;  // the bit above marks a sample's last datagram

// Numbers of segments, from 1.
constexpr uint32_t kPelvis = 1, kChestSegment = 5, kNeckSegment = 6, kHeadSegment = 7, kMostSegments = 14;
constexpr std::pair<uint32_t, const char*> kMvnJoints[] = {
    {kNeckSegment, kNeckJoint}, {kChestSegment, kChestJoint}, {13, kLeftShoulderJoint},
    {9, kRightShoulderJoint},   {14, kLeftElbowJoint},        {10, kRightElbowJoint}};

struct MvnSegment {
  glm::dvec3 position{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
};

struct MvnSample {
  uint32_t number = 0;
  uint8_t datagram = 0, character = 0;
  uint32_t time_ms = 0;
  std::array<std::optional<MvnSegment>, kMostSegments + 1> segment;  // by their numbers
};

Result<MvnSample> read_sample(BigEndianReader reader, size_t payload_bytes) {
  MvnSample sample;
  sample.number = reader.take<uint32_t>();
  sample.datagram = reader.take<uint8_t>() & kDatagramMask;
  const auto items = reader.take<uint8_t>();
  sample.time_ms = reader.take<uint32_t>();
  sample.character = reader.take<uint8_t>();
  (void)reader.take_bytes(5);  // numbers of segments, props and fingers, and what is reserved
  const auto told_bytes = reader.take<uint16_t>();
  // Before 2019 the header told no size.
  if (payload_bytes != items * kMvnItemBytes || (told_bytes != 0 && told_bytes != payload_bytes))
    return make_error(ErrorCode::BadInput, "{} segments of MVN have {} bytes, this packet has {} and says {}",
                      items, items * kMvnItemBytes, payload_bytes, told_bytes);
  for (uint32_t i = 0; i < items; ++i) {
    const auto number = reader.take<uint32_t>();
    std::array<double, 7> value{};
    for (double& one : value) one = reader.take<float>();
    if (number < 1 || number > kMostSegments) continue;
    sample.segment[number] = {{value[0], value[1], value[2]}, {value[3], value[4], value[5], value[6]}};
  }
  return sample;
}

class MvnParser : public LiveParser {
 public:
  Result<LivePacket> parse(std::span<const std::byte> bytes, int64_t) override {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (!text.starts_with(kMark) || bytes.size() < kMvnHeaderBytes)
      return make_error(ErrorCode::BadInput, "a packet of MVN begins with \"{}\" and has {} bytes at least",
                        kMark, kMvnHeaderBytes);
    const std::string_view kind = text.substr(kMark.size(), kQuaternions.size());
    if (kind != kQuaternions) {
      if (kind == kEulerAngles && !std::exchange(has_told_kind_, true))
        notes_.emplace_back("it sends Euler angles: let it send positions and orientations as quaternions");
      ++ignored_;
      return LivePacket{};
    }
    ASSIGN_OR_RETURN(const MvnSample sample,
                     read_sample(BigEndianReader(bytes.subspan(kMark.size() + kind.size())),
                                 bytes.size() - kMvnHeaderBytes));
    find_unit(sample);
    last_ = sample;
    LivePacket packet;
    if (sample.segment[kHeadSegment]) packet.poses.push_back(pose_of(sample));
    return packet;
  }

  uint64_t ignored() const override { return ignored_; }
  std::vector<std::string> take_notes() override { return std::exchange(notes_, {}); }

  std::vector<std::string> describe() const override {
    if (!last_) return {};
    MonitorLines lines;
    lines.add(fmt::format("character {}, sample {}, {} ms", last_->character, last_->number, last_->time_ms));
    for (uint32_t i = 1; i <= kMostSegments; ++i) {
      const auto& segment = last_->segment[i];
      if (!segment) continue;
      const glm::dvec3& p = segment->position;
      const glm::dquat& r = segment->rotation;
      lines.add(fmt::format("segment {}: x {:.4f} y {:.4f} z {:.4f}, turned {:.3f} {:.3f} {:.3f} {:.3f}", i,
                            p.x, p.y, p.z, r.w, r.x, r.y, r.z));
    }
    return std::move(lines).take();
  }

 private:
  /// From the first packet on that shows a body.
  void find_unit(const MvnSample& sample) {
    constexpr double kLeastTorsoM = 0.2, kMostTorsoM = 1.2;
    const auto &pelvis = sample.segment[kPelvis], &head = sample.segment[kHeadSegment];
    if (has_unit_ || !pelvis || !head) return;
    const double torso = glm::distance(pelvis->position, head->position);
    for (const double unit_m : {kMPerCm, 1.0}) {
      if (torso * unit_m < kLeastTorsoM || torso * unit_m > kMostTorsoM) continue;
      unit_m_ = unit_m;
      has_unit_ = true;
    }
    if (has_unit_ && unit_m_ == 1.0)
      notes_.emplace_back("its places are taken as metres: from pelvis to head it is less than two units");
  }

  LivePose pose_of(const MvnSample& sample) const {
    LivePose pose;
    pose.subject = fmt::format("{}", sample.character);
    const auto placed = [&](const MvnSegment& segment) {
      return pose_from_mvn(unit_m_ * segment.position, segment.rotation);
    };
    pose.world_from_subject = placed(*sample.segment[kHeadSegment]);
    pose.source_time_ns = int64_t{sample.time_ms} * kNsPerMsWhole;
    pose.frame = sample.number;
    for (const auto& [number, name] : kMvnJoints) {
      const auto& segment = sample.segment[number];
      if (!segment) continue;
      pose.joint_names.emplace_back(name);
      pose.joint_m.push_back(placed(*segment).position_m);
    }
    return pose;
  }

  static constexpr int64_t kNsPerMsWhole = 1'000'000;
  double unit_m_ = kMPerCm;
  bool has_unit_ = false, has_told_kind_ = false;
  std::optional<MvnSample> last_;
  std::vector<std::string> notes_;
  uint64_t ignored_ = 0;
};

}  // namespace

std::unique_ptr<LiveParser> make_mvn_parser() {
  return std::make_unique<MvnParser>();
}

}  // namespace strandcast
