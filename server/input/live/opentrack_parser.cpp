// opentrack's "UDP over network": six doubles in one datagram, of one subject. Its source writes places first
// (the array headpose of proto-udp; `xyz-ypr`), a page of its documentation says angles first (`ypr-xyz`): a
// setting. They are in the order of bytes of the sender's machine, little-endian unless five packets show
// otherwise.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "common/strands/byte_io.h"
#include "server/input/live/conventions.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

constexpr size_t kNumbers = 6;
constexpr size_t kOpentrackPacketBytes = kNumbers * sizeof(double);

using Numbers = std::array<double, kNumbers>;

Numbers turned_round(const Numbers& numbers) {
  Numbers others{};
  for (size_t i = 0; i < kNumbers; ++i) {
    auto bytes = std::bit_cast<std::array<std::byte, sizeof(double)>>(numbers[i]);
    std::reverse(bytes.begin(), bytes.end());
    others[i] = std::bit_cast<double>(bytes);
  }
  return others;
}

/// Numbers of a head, cm or degrees: none, or of a size that a tracker measures. What is read in the wrong
/// order of bytes has any exponent: one in about a hundred is of that size.
bool are_usual(const Numbers& numbers) {
  constexpr double kLeast = 1e-3, kMost = 1e4;
  return std::all_of(numbers.begin(), numbers.end(), [](double number) {
    return number == 0.0 || (std::abs(number) >= kLeast && std::abs(number) <= kMost);
  });
}

/// Numbers of which one is beyond the world, or so small that nobody measures it, as round numbers are in the
/// wrong order. Filters that come to rest send small ones too.
bool are_absurd(const Numbers& numbers) {
  constexpr double kMost = 1e6;
  return std::any_of(numbers.begin(), numbers.end(), [](double number) {
    return number != 0.0 && !(std::isnormal(number) && std::abs(number) <= kMost);
  });
}

/// Packets more for one order of bytes than for the other, or for none, that decide.
constexpr int kOrderVotes = 5;

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
    Numbers little{};
    for (double& number : little) number = reader.take<double>();
    const Numbers big = turned_round(little);
    const bool is_zero = little == Numbers{};  // in either order
    const int vote = are_usual(big) && are_absurd(little) ? 1 : are_usual(little) && are_absurd(big) ? -1 : 0;
    if (!is_zero) note_vote(vote);
    last_ = is_big_endian_ ? big : little;
    LivePacket packet;
    if (is_big_endian_ ? vote < 0 : vote > 0) {  // of the other order, which is not believed yet
      ++ignored_;
      return packet;
    }
    packet.poses.emplace_back().world_from_subject = pose_from_opentrack(last_pose());
    return packet;
  }

  uint64_t ignored() const override { return ignored_; }
  std::vector<std::string> take_notes() override { return std::exchange(notes_, {}); }

  std::vector<std::string> describe() const override {
    if (!last_) return {};
    const OpentrackPose pose = last_pose();
    return {fmt::format("x {:.2f} y {:.2f} z {:.2f} cm", pose.position_cm.x, pose.position_cm.y,
                        pose.position_cm.z),
            fmt::format("yaw {:.2f} pitch {:.2f} roll {:.2f} degrees", pose.yaw_deg, pose.pitch_deg,
                        pose.roll_deg)};
  }

 private:
  /// +1 for a packet that is a head's in big-endian order alone, -1 for one that is so in little-endian.
  void note_vote(int vote) {
    if (vote == 0) vote = votes_ > 0 ? -1 : votes_ < 0 ? 1 : 0;
    votes_ = std::clamp(votes_ + vote, -kOrderVotes, kOrderVotes);
    if (std::abs(votes_) < kOrderVotes || is_big_endian_ == (votes_ > 0)) return;
    is_big_endian_ = votes_ > 0;
    notes_.push_back(fmt::format("the sender's numbers are {}-endian, and are read so",
                                 is_big_endian_ ? "big" : "little"));
  }

  OpentrackPose last_pose() const {
    const auto& number = *last_;
    return {{number[x_at_], number[x_at_ + 1], number[x_at_ + 2]},
            number[yaw_at_],
            number[yaw_at_ + 1],
            number[yaw_at_ + 2]};
  }

  size_t x_at_, yaw_at_;
  int votes_ = 0;
  bool is_big_endian_ = false;
  uint64_t ignored_ = 0;
  std::vector<std::string> notes_;
  std::optional<Numbers> last_;
};

}  // namespace

std::unique_ptr<LiveParser> make_opentrack_parser(size_t axis_order) {
  constexpr size_t kSecondHalf = kNumbers / 2;
  return axis_order == 0 ? std::make_unique<OpentrackParser>(0, kSecondHalf)
                         : std::make_unique<OpentrackParser>(kSecondHalf, 0);
}

}  // namespace strandcast
