// VRPN over one TCP connection: a cookie, then framed messages, of which names (types -1 and -2) and the
// poses of trackers matter. By R. Pavlik's description of the protocol (CC BY 4.0). Chunks may end anywhere.
// A subject is a tracker, `Name/2` its sensor 2. Axes are `y-up` or `z-up`.
#include <array>
#include <cstring>
#include <map>

#include "common/base/text.h"
#include "server/input/live/big_endian_reader.h"
#include "server/input/live/conventions.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

constexpr size_t kCookieBytes = 24;
constexpr std::string_view kCookie = "vrpn: ver. 07.35  0";  // the digit: no logging at the other end
constexpr std::string_view kCookieOfMajor = "vrpn: ver. 07.";
constexpr size_t kHeaderBytes = 24;  // five numbers and a sequence number that lengths do not count apart
constexpr size_t kVrpnAlignBytes = 8;
constexpr size_t kMaxMessageBytes = 64'000;  // what VRPN's own buffers hold
constexpr size_t kMaxNames = 1024;           // of senders, and of types
constexpr uint32_t kMaxVrpnNameBytes = 512;
constexpr int32_t kSenderDescription = -1, kTypeDescription = -2;
constexpr std::string_view kVrpnPoseType = "vrpn_Tracker Pos_Quat";
constexpr size_t kPoseBytes = 2 * sizeof(int32_t) + 7 * sizeof(double);

struct VrpnMessage {
  int64_t time_ns = 0;
  int32_t sender = 0;
  int32_t type = 0;
  std::span<const std::byte> body;
};

std::string_view vrpn_text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// The name in a description: its length with NUL, then the name with it.
std::optional<std::string_view> name_in(std::span<const std::byte> body) {
  BigEndianReader reader(body);
  const auto length = reader.take<uint32_t>();
  if (!reader.ok() || length == 0 || length > kMaxVrpnNameBytes || length > reader.rest().size())
    return std::nullopt;
  const std::string_view text = vrpn_text_of(reader.take_bytes(length));
  return text.substr(0, text.find('\0'));
}

struct TrackerPose {
  std::string subject;
  glm::dvec3 position_m{0.0};
  glm::dvec4 rotation_xyzw{0.0};
};

class VrpnParser : public LiveParser {
 public:
  explicit VrpnParser(SystemUp up) : up_(up) {}

  Result<LivePacket> parse(std::span<const std::byte> bytes, int64_t) override {
    // Everything is checked before anything is taken, so that an error changes nothing.
    const size_t kept_bytes = buffer_.size();
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    const auto taken_bytes = walk(nullptr);
    if (!taken_bytes) {
      buffer_.resize(kept_bytes);
      return taken_bytes.error();
    }
    last_.clear();
    LivePacket packet;
    (void)walk(&packet);
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<ptrdiff_t>(*taken_bytes));
    has_cookie_ = has_cookie_ || *taken_bytes > 0;
    return packet;
  }

  std::vector<std::byte> greeting() const override {
    std::vector<std::byte> cookie(kCookieBytes);
    std::memcpy(cookie.data(), kCookie.data(), kCookie.size());
    return cookie;
  }

  uint64_t ignored() const override { return ignored_; }

  std::vector<std::string> describe() const override {
    MonitorLines lines;
    for (const TrackerPose& pose : last_) {
      const glm::dvec3& p = pose.position_m;
      const glm::dvec4& q = pose.rotation_xyzw;
      lines.add(lines.has_room()
                    ? fmt::format("{}: x {:.4f} y {:.4f} z {:.4f}, quaternion {:.4f} {:.4f} {:.4f} {:.4f}",
                                  pose.subject, p.x, p.y, p.z, q.x, q.y, q.z, q.w)
                    : "");
    }
    return std::move(lines).take();
  }

 private:
  /// Goes through all that is whole in the buffer: checks it or, with a packet, takes it. Gives the bytes of
  /// it.
  Result<size_t> walk(LivePacket* packet) {
    BigEndianReader reader(buffer_);
    if (!has_cookie_) {
      const std::string_view begin = vrpn_text_of(buffer_).substr(0, kCookieOfMajor.size());
      if (begin != kCookieOfMajor.substr(0, begin.size()))
        return make_error(ErrorCode::BadInput, "a peer that begins with \"{}\" is no server of VRPN 7",
                          excerpt(begin, kCookieOfMajor.size()));
      if (buffer_.size() < kCookieBytes) return size_t{0};
      (void)reader.take_bytes(kCookieBytes);
    }
    while (reader.rest().size() >= kHeaderBytes) {
      const size_t left = reader.rest().size();
      BigEndianReader ahead(reader.rest());
      const auto length = ahead.take<uint32_t>();
      if (length < kHeaderBytes || length > kMaxMessageBytes)
        return make_error(length < kHeaderBytes ? ErrorCode::BadInput : ErrorCode::LimitExceeded,
                          "a message of VRPN of {} bytes; {} to {} are allowed", length, kHeaderBytes,
                          kMaxMessageBytes);
      const size_t padded = (length + kVrpnAlignBytes - 1) / kVrpnAlignBytes * kVrpnAlignBytes;
      if (padded > left) break;
      VrpnMessage message;
      const int64_t seconds = ahead.take<int32_t>(), microseconds = ahead.take<int32_t>();
      message.time_ns = seconds * 1'000'000'000 + microseconds * 1'000;
      message.sender = ahead.take<int32_t>();
      message.type = ahead.take<int32_t>();
      message.body = reader.take_bytes(padded).first(length).subspan(kHeaderBytes);
      if (packet == nullptr) {
        RETURN_IF_ERROR(check(message));
      } else {
        apply(message, *packet);
      }
    }
    return buffer_.size() - reader.rest().size();
  }

  static bool is_description(const VrpnMessage& message) {
    return message.type == kSenderDescription || message.type == kTypeDescription;
  }

  static Status check(const VrpnMessage& message) {
    if (!is_description(message)) return {};
    if (!name_in(message.body))
      return make_error(ErrorCode::BadInput, "a description of VRPN without a name");
    if (message.sender < 0 || static_cast<size_t>(message.sender) >= kMaxNames)
      return make_error(ErrorCode::LimitExceeded, "VRPN describes number {}; 0 to {} are allowed",
                        message.sender, kMaxNames - 1);
    return {};
  }

  void apply(const VrpnMessage& message, LivePacket& packet) {
    if (is_description(message)) {
      // What a description describes stands where others have their sender.
      const std::string_view name = *name_in(message.body);
      if (message.type == kTypeDescription)
        is_pose_type_[message.sender] = name == kVrpnPoseType;
      else
        senders_[message.sender] = one_line(name, kMaxSubjectBytes);
      return;
    }
    const auto type = is_pose_type_.find(message.type);
    if (type == is_pose_type_.end() || !type->second || message.body.size() != kPoseBytes) {
      ++ignored_;
      return;
    }
    BigEndianReader reader(message.body);
    const auto sensor = reader.take<int32_t>();
    (void)reader.take<int32_t>();
    TrackerPose& tracker = last_.emplace_back();
    for (int axis = 0; axis < 3; ++axis) tracker.position_m[axis] = reader.take<double>();
    for (int k = 0; k < 4; ++k) tracker.rotation_xyzw[k] = reader.take<double>();
    tracker.subject = subject_of(message.sender, sensor);
    LivePose& pose = packet.poses.emplace_back();
    pose.subject = tracker.subject;
    pose.world_from_subject = pose_from_system(up_, tracker.position_m, quaternion_of(tracker.rotation_xyzw));
    pose.source_time_ns = message.time_ns;
  }

  /// The tracker's name; of one with several sensors those after the first with their number.
  std::string subject_of(int32_t sender, int32_t sensor) const {
    const auto found = senders_.find(sender);
    const std::string name = found != senders_.end() ? found->second : fmt::format("{}", sender);
    return sensor == 0 ? name : fmt::format("{}/{}", name, sensor);
  }

  SystemUp up_;
  std::vector<std::byte> buffer_;  // what is not whole yet
  bool has_cookie_ = false;
  std::map<int32_t, std::string> senders_;
  std::map<int32_t, bool> is_pose_type_;
  std::vector<TrackerPose> last_;
  uint64_t ignored_ = 0;
};

}  // namespace

std::unique_ptr<LiveParser> make_vrpn_parser(size_t axis_order) {
  return std::make_unique<VrpnParser>(axis_order == 0 ? SystemUp::Y : SystemUp::Z);
}

}  // namespace strandcast
