// opentrack's "UDP over network": six doubles, little-endian, in one datagram. Its source writes places first
// (the array headpose of proto-udp), a page of its documentation says angles first: a setting.
#include <array>

#include "common/strands/byte_io.h"
#include "server/input/live/conventions.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

constexpr size_t kNumbers = 6;
constexpr size_t kOpentrackPacketBytes = kNumbers * sizeof(double);

class OpentrackParser : public LiveParser {
 public:
  /// Where x and yaw stand in the packet: what follows them follows there.
  OpentrackParser(size_t x_at, size_t yaw_at) : x_at_(x_at), yaw_at_(yaw_at) {}

  Result<LivePacket> parse(std::span<const std::byte> bytes, int64_t) override {
    if (bytes.size() != kOpentrackPacketBytes)
      return make_error(
          ErrorCode::BadInput,
          "a packet of opentrack has {} bytes and this one {}: is this its output \"UDP over network\"?",
          kOpentrackPacketBytes, bytes.size());
    ByteReader reader(bytes);
    for (double& number : last_.emplace()) number = reader.take<double>();
    LivePacket packet;
    packet.poses.emplace_back().world_from_subject = pose_from_opentrack(last_pose());
    return packet;
  }

  uint64_t ignored() const override { return 0; }

  std::vector<std::string> describe() const override {
    if (!last_) return {};
    const OpentrackPose pose = last_pose();
    return {fmt::format("x {:.2f} y {:.2f} z {:.2f} cm", pose.position_cm.x, pose.position_cm.y,
                        pose.position_cm.z),
            fmt::format("yaw {:.2f} pitch {:.2f} roll {:.2f} degrees", pose.yaw_deg, pose.pitch_deg,
                        pose.roll_deg)};
  }

 private:
  OpentrackPose last_pose() const {
    const auto& number = *last_;
    return {{number[x_at_], number[x_at_ + 1], number[x_at_ + 2]},
            number[yaw_at_],
            number[yaw_at_ + 1],
            number[yaw_at_ + 2]};
  }

  size_t x_at_, yaw_at_;
  std::optional<std::array<double, kNumbers>> last_;
};

}  // namespace

std::unique_ptr<LiveParser> make_opentrack_parser(size_t axis_order) {
  constexpr size_t kSecondHalf = kNumbers / 2;
  return axis_order == 0 ? std::make_unique<OpentrackParser>(0, kSecondHalf)
                         : std::make_unique<OpentrackParser>(kSecondHalf, 0);
}

}  // namespace strandcast
