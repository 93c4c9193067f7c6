// Live Link Face, the app that sends what ARKit sees of a face: version 6 of its packets. The layout is not
// published; it is as several independent readers have it. Of its 61 values only the turns of the head matter
// here, in `half-turns` or `radians`. The subject has the phone's name.
#include <array>

#include "common/base/text.h"
#include "server/input/live/big_endian_reader.h"
#include "server/input/live/conventions.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

constexpr uint8_t kVersion = 6;
constexpr size_t kValueCount = 61;
constexpr size_t kHeadYawAt = 52, kHeadPitchAt = 53, kHeadRollAt = 54;
constexpr uint32_t kMaxNameBytes = 1024;

struct FacePacket {
  std::string device, subject;
  uint32_t frame = 0;
  std::optional<double> time_s;  // of day
  std::optional<Timecode> timecode;
  bool has_values = false;  // none while no face is in front of the camera
  std::array<float, kValueCount> value{};
};

std::optional<std::string> take_name(BigEndianReader& reader) {
  const auto length = reader.take<uint32_t>();
  if (length > kMaxNameBytes) return std::nullopt;
  const auto bytes = reader.take_bytes(length);
  if (!reader.ok()) return std::nullopt;
  return one_line({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, kMaxSubjectBytes);
}

/// Takes the time of a frame number with a part of a frame, and frames per second as a fraction. The number
/// is since midnight where the phone has timecode.
void take_time(BigEndianReader& reader, FacePacket& packet) {
  const double part = reader.take<float>();
  const auto frames = reader.take<int32_t>(), seconds = reader.take<int32_t>();
  if (frames <= 0 || seconds <= 0) return;
  packet.time_s = (static_cast<int32_t>(packet.frame) + part) * seconds / frames;
  const FrameRate rate{static_cast<uint32_t>(frames), static_cast<uint32_t>(seconds)};
  if (static_cast<int32_t>(packet.frame) < 0 || !is_timecode_rate(rate, false) ||
      !(part >= 0.0 && part < 1.0))
    return;
  packet.timecode = Timecode{rate, false, packet.frame % frames_per_day(rate, false), part};
}

Result<FacePacket> read_face(std::span<const std::byte> bytes) {
  // Some senders put the packet's size in front, whose first byte is no version.
  BigEndianReader sized(bytes);
  const auto size = sized.take<uint32_t>();
  if (sized.ok() && size == sized.rest().size()) bytes = sized.rest();
  BigEndianReader reader(bytes);
  const auto version = reader.take<uint8_t>();
  if (version != kVersion)
    return make_error(ErrorCode::BadInput,
                      "a packet of Live Link Face begins with version {} and this one with {}", kVersion,
                      version);
  FacePacket packet;
  for (std::string* name : {&packet.device, &packet.subject}) {
    auto taken = take_name(reader);
    if (!taken)
      return make_error(ErrorCode::BadInput, "a packet of Live Link Face of {} bytes ends within its names",
                        bytes.size());
    *name = std::move(*taken);
  }
  if (reader.rest().empty()) return packet;
  packet.frame = reader.take<uint32_t>();
  take_time(reader, packet);
  const size_t count = reader.rest().empty() ? 0 : reader.take<uint8_t>();
  if (!reader.ok() || (count != 0 && count != kValueCount) || reader.rest().size() != count * sizeof(float))
    return make_error(ErrorCode::BadInput,
                      "a packet of Live Link Face with {} values and {} bytes for them; {} values are right",
                      count, reader.rest().size(), kValueCount);
  packet.has_values = count != 0;
  for (size_t i = 0; i < count; ++i) packet.value[i] = reader.take<float>();
  return packet;
}

class LiveLinkFaceParser : public LiveParser {
 public:
  explicit LiveLinkFaceParser(double rad_per_unit) : rad_per_unit_(rad_per_unit) {}

  Result<LivePacket> parse(std::span<const std::byte> bytes, int64_t) override {
    ASSIGN_OR_RETURN(FacePacket face, read_face(bytes));
    LivePacket packet;
    if (face.has_values) {
      LivePose& pose = packet.poses.emplace_back();
      pose.subject = face.subject;
      pose.world_from_subject =
          pose_from_face(rad_per_unit_ * face.value[kHeadYawAt], rad_per_unit_ * face.value[kHeadPitchAt],
                         rad_per_unit_ * face.value[kHeadRollAt]);
      pose.has_position = false;
      pose.frame = face.frame;
      pose.timecode = face.timecode;
      if (face.time_s) pose.source_time_ns = nanoseconds_of(*face.time_s);
    }
    last_ = std::move(face);
    return packet;
  }

  uint64_t ignored() const override { return 0; }

  std::vector<std::string> describe() const override {
    if (!last_) return {};
    std::vector<std::string> lines = {
        fmt::format("subject \"{}\" of device \"{}\"", last_->subject, last_->device),
        fmt::format("frame {} at {:.4f} s", last_->frame, last_->time_s.value_or(0.0))};
    const auto& value = last_->value;
    lines.push_back(last_->has_values
                        ? fmt::format("head yaw {:.4f} pitch {:.4f} roll {:.4f}", value[kHeadYawAt],
                                      value[kHeadPitchAt], value[kHeadRollAt])
                        : "no face");
    return lines;
  }

 private:
  double rad_per_unit_;
  std::optional<FacePacket> last_;
};

}  // namespace

std::unique_ptr<LiveParser> make_live_link_face_parser(size_t axis_order) {
  return std::make_unique<LiveLinkFaceParser>(axis_order == 0 ? kRadPerHalfTurn : 1.0);
}

}  // namespace strandcast
