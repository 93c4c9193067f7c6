// FreeD, message D1, of cameras and heads in virtual production: Vinten's manual, appendix A.3.2 and B. A
// subject is a camera's number. Angles are `pan-tilt-roll` or `tilt-pan-roll`. The spare word is the sender's
// own; where it, or some of its bits, counts frames of timecode, their number goes on beyond those bits.
#include <array>
#include <cmath>
#include <utility>

#include "common/base/units.h"
#include "common/strands/byte_io.h"
#include "server/input/live/conventions.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

constexpr size_t kFreedPacketBytes = 29;
constexpr uint8_t kFreedPoseType = 0xD1;
constexpr uint8_t kFamilyMask = 0xF0;  // all types of FreeD begin with D
constexpr uint8_t kFamily = 0xD0;
constexpr uint32_t kSpareBits = 16;
constexpr uint32_t kJudgedPackets = 120;  // after which a count that stood still is none
constexpr int64_t kCountWindowNs = 2 * kSInNs;
constexpr double kOtherRate = 0.1;  // counts that differ by less are the same
constexpr uint8_t kChecksumBegin = 0x40;
constexpr double kUnitsPerDegree = 32768.0;
constexpr double kUnitsPerMm = 64.0;

/// What a packet says, in its own units.
struct FreedFields {
  uint8_t camera = 0;
  std::array<int32_t, 3> angle{};     // in the order of the packet
  std::array<int32_t, 3> position{};  // x, y, height
  uint32_t zoom = 0;
  uint32_t focus = 0;
  uint32_t spare = 0;
};

uint8_t checksum_of(std::span<const std::byte> bytes) {
  uint8_t sum = kChecksumBegin;
  for (const std::byte byte : bytes) sum = static_cast<uint8_t>(sum - std::to_integer<uint8_t>(byte));
  return sum;
}

uint32_t take_three(ByteReader& reader) {
  const uint32_t high = reader.take<uint8_t>(), middle = reader.take<uint8_t>(), low = reader.take<uint8_t>();
  return high << 16 | middle << 8 | low;
}
int32_t take_signed_three(ByteReader& reader) {
  constexpr uint32_t kSign = 1u << 23;
  return static_cast<int32_t>(take_three(reader) ^ kSign) - static_cast<int32_t>(kSign);
}

FreedFields take_fields(ByteReader reader) {
  FreedFields fields;
  (void)reader.take<uint8_t>();
  fields.camera = reader.take<uint8_t>();
  for (int32_t& angle : fields.angle) angle = take_signed_three(reader);
  for (int32_t& position : fields.position) position = take_signed_three(reader);
  fields.zoom = take_three(reader);
  fields.focus = take_three(reader);
  const uint32_t high = reader.take<uint8_t>();
  fields.spare = high << 8 | reader.take<uint8_t>();
  return fields;
}

class FreedParser : public LiveParser {
 public:
  /// Which of the three angles pan and tilt are.
  FreedParser(size_t pan_at, size_t tilt_at, const std::optional<SpareCount>& count)
      : pan_at_(pan_at), tilt_at_(tilt_at), count_(count), frames_(count ? count->bits : kSpareBits) {}

  Result<LivePacket> parse(std::span<const std::byte> bytes, int64_t arrival_ns) override {
    const uint8_t type = bytes.empty() ? uint8_t{0} : std::to_integer<uint8_t>(bytes.front());
    if ((type & kFamilyMask) == kFamily && type != kFreedPoseType) {
      ++ignored_;
      return LivePacket{};
    }
    if (bytes.size() != kFreedPacketBytes || type != kFreedPoseType)
      return make_error(
          ErrorCode::BadInput,
          "a packet of FreeD D1 has {} bytes and begins with 0xD1, this one has {} and begins with {:#04x}",
          kFreedPacketBytes, bytes.size(), type);
    const uint8_t sent = std::to_integer<uint8_t>(bytes.back());
    const uint8_t computed = checksum_of(bytes.first(kFreedPacketBytes - 1));
    if (sent != computed)
      return make_error(ErrorCode::BadInput,
                        "a packet of FreeD with the wrong checksum: {:#04x} where {:#04x} is right", sent,
                        computed);
    last_ = take_fields(ByteReader(bytes));
    LivePacket packet;
    LivePose& pose = packet.poses.emplace_back();
    pose.subject = fmt::format("{}", last_->camera);
    pose.world_from_subject = pose_from_freed(last_pose());
    if (count_) {
      const uint32_t number = last_->spare >> count_->first_bit & ((1u << count_->bits) - 1);
      const auto frame = static_cast<int32_t>(frames_.unwrapped(number));
      newest_ = advanced(count_->begin, frame);
      pose.timecode = newest_;
      note_count(number);
      measure(frame, arrival_ns);
    }
    return packet;
  }

  uint64_t ignored() const override { return ignored_; }

  std::vector<std::string> describe() const override {
    if (!last_) return {};
    const FreedPose pose = last_pose();
    const glm::dvec3& p = pose.position_mm;
    return {
        fmt::format("camera {}", last_->camera),
        fmt::format("pan {:.3f} tilt {:.3f} roll {:.3f} degrees", pose.pan_deg, pose.tilt_deg, pose.roll_deg),
        fmt::format("x {:.2f} y {:.2f} height {:.2f} mm", p.x, p.y, p.z),
        fmt::format("zoom {} focus {}", last_->zoom, last_->focus),
        fmt::format("spare word {}{}", last_->spare, newest_ ? ", timecode " + timecode_text(*newest_) : "")};
  }

  std::vector<std::string> take_notes() override { return std::exchange(notes_, {}); }

 private:
  /// Says once that what is taken for a count of frames is none.
  void note_count(uint32_t number) {
    ++counted_packets_;
    if (counted_ && number != *counted_) has_counted_ = true;
    counted_ = number;
    if (counted_packets_ == kJudgedPackets && !has_counted_)
      notes_.push_back(
          fmt::format("the bits of the spare word that --mocap-timecode names stand at {}: they "
                      "count no frames",
                      number));
  }

  /// Says once that frames are counted at another rate than was said, where two windows agree.
  void measure(int32_t frame, int64_t arrival_ns) {
    if (!window_) window_ = CountWindow{frame, arrival_ns, 0.0};
    const int64_t passed_ns = arrival_ns - window_->begin_ns;
    if (passed_ns < kCountWindowNs) return;
    const double said_hz = count_->begin.rate.hz();
    const double hz =
        (static_cast<double>(frame) - window_->begin) / (static_cast<double>(passed_ns) * kSPerNs);
    const auto differ = [](double a, double b) { return std::abs(a - b) > kOtherRate * b; };
    const bool is_other = hz > 0.0 && differ(hz, said_hz) && !differ(window_->hz_before, hz);
    const double mean_hz = 0.5 * (hz + window_->hz_before);
    window_ = CountWindow{frame, arrival_ns, hz};
    if (!is_other || std::exchange(has_told_rate_, true)) return;
    notes_.push_back(
        fmt::format("the spare word counts about {:.0f} frames a second, and --mocap-timecode says {}",
                    mean_hz, frame_rate_text(said_hz)));
  }

  FreedPose last_pose() const {
    constexpr size_t kRollAt = 2;
    const FreedFields& fields = *last_;
    const auto degrees = [&](size_t at) { return fields.angle[at] / kUnitsPerDegree; };
    return {glm::dvec3(fields.position[0], fields.position[1], fields.position[2]) / kUnitsPerMm,
            degrees(pan_at_), degrees(tilt_at_), degrees(kRollAt)};
  }

  size_t pan_at_, tilt_at_;
  std::optional<SpareCount> count_;
  WrappingCount frames_;
  std::optional<Timecode> newest_;
  std::optional<uint32_t> counted_;  // of the newest packet
  uint32_t counted_packets_ = 0;
  bool has_counted_ = false;
  struct CountWindow {
    int32_t begin = 0;  // its first frame
    int64_t begin_ns = 0;
    double hz_before = 0.0;  // of the window before
  };
  std::optional<CountWindow> window_;
  bool has_told_rate_ = false;
  std::vector<std::string> notes_;
  std::optional<FreedFields> last_;
  uint64_t ignored_ = 0;
};

}  // namespace

std::unique_ptr<LiveParser> make_freed_parser(size_t axis_order, const std::optional<SpareCount>& count) {
  return std::make_unique<FreedParser>(axis_order, 1 - axis_order, count);
}

}  // namespace strandcast
