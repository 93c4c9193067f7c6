#include "common/motion/mocap_packet.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <string_view>

#include "common/base/units.h"
#include "common/motion/opentrackio.h"

namespace strandcast {
namespace {

constexpr double kDegreesPerRad = 180.0 / std::numbers::pi;

/// A rotation as a turn about +Y (to the left), then about the head's own +X (nod down), then about its own
/// +Z (tilt to the right).
struct HeadAngles {
  double left_deg = 0.0;
  double down_deg = 0.0;
  double tilt_right_deg = 0.0;
};

HeadAngles angles_of(const glm::dquat& rotation) {
  const glm::dmat3 m = glm::mat3_cast(rotation);  // by columns
  return {kDegreesPerRad * std::atan2(m[2][0], m[2][2]),
          kDegreesPerRad * std::asin(std::clamp(-m[2][1], -1.0, 1.0)),
          kDegreesPerRad * std::atan2(m[0][1], m[1][1])};
}

class Packet {
 public:
  template <class T>
  void put(T number, std::endian order) {
    auto bytes = std::bit_cast<std::array<std::byte, sizeof(T)>>(number);
    if (order != std::endian::native) std::reverse(bytes.begin(), bytes.end());
    for (const std::byte byte : bytes) bytes_.push_back(byte);
  }
  /// Two's complement in three bytes, the highest first; numbers beyond it stop at its ends.
  void put_three(double number) {
    constexpr double kMost = (1 << 23) - 1;
    const auto bits =
        static_cast<uint32_t>(static_cast<int32_t>(std::lround(std::clamp(number, -kMost, kMost))));
    for (const int shift : {16, 8, 0}) put(static_cast<uint8_t>(bits >> shift), std::endian::big);
  }
  /// A text of OSC: a zero behind it, and more to a multiple of four.
  void put_text(std::string_view text) {
    for (const char letter : text) bytes_.push_back(static_cast<std::byte>(letter));
    do bytes_.push_back(std::byte{0});
    while (bytes_.size() % 4 != 0);
  }
  void append(const std::vector<std::byte>& bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

// ---- opentrack: six doubles, cm and degrees; +X to the head's left, +Z behind it

std::vector<std::byte> encode_opentrack(const MocapMoment& moment) {
  const glm::dvec3 p = kCmPerM * moment.world_from_head.position_m;
  const HeadAngles angles = angles_of(moment.world_from_head.rotation);
  Packet packet;
  for (const double number : {p.x, p.y, -p.z, -angles.left_deg, -angles.down_deg, -angles.tilt_right_deg})
    packet.put(number, std::endian::little);
  return packet.bytes();
}

// ---- FreeD D1: a camera; +Z up, it looks along +Y

std::vector<std::byte> encode_freed(const MocapMoment& moment) {
  constexpr double kUnitsPerDegree = 32768.0, kUnitsPerM = 64'000.0;
  constexpr uint8_t kType = 0xD1, kChecksumBegin = 0x40;
  constexpr int kZoomFocus = 6;
  const glm::dvec3& p = moment.world_from_head.position_m;
  const HeadAngles angles = angles_of(moment.world_from_head.rotation);
  Packet packet;
  packet.put(kType, std::endian::big);
  packet.put(static_cast<uint8_t>(moment.source), std::endian::big);
  for (const double degrees : {-angles.left_deg, -angles.down_deg, angles.tilt_right_deg})
    packet.put_three(kUnitsPerDegree * degrees);
  for (const double metres : {-p.x, p.z, p.y}) packet.put_three(kUnitsPerM * metres);
  for (int i = 0; i < kZoomFocus; ++i) packet.put(uint8_t{0}, std::endian::big);
  packet.put(static_cast<uint16_t>(moment.timecode ? moment.timecode->frame : 0), std::endian::big);
  uint8_t sum = kChecksumBegin;
  for (const std::byte byte : packet.bytes())
    sum = static_cast<uint8_t>(sum - std::to_integer<uint8_t>(byte));
  packet.put(sum, std::endian::big);
  return packet.bytes();
}

// ---- VMC: OSC; Unity's axes, left-handed

std::vector<std::byte> osc_message(std::string_view address, std::string_view name,
                                   const std::vector<double>& numbers) {
  Packet packet;
  packet.put_text(address);
  std::string tags = ",";
  if (!name.empty()) tags += 's';
  tags.append(numbers.size(), 'f');
  packet.put_text(tags);
  if (!name.empty()) packet.put_text(name);
  for (const double number : numbers) packet.put(static_cast<float>(number), std::endian::big);
  return packet.bytes();
}

std::vector<std::byte> osc_bundle(const std::vector<std::vector<std::byte>>& messages) {
  constexpr uint64_t kImmediately = 1;
  Packet bundle;
  bundle.put_text("#bundle");
  bundle.put(kImmediately, std::endian::big);
  for (const auto& message : messages) {
    bundle.put(static_cast<uint32_t>(message.size()), std::endian::big);
    bundle.append(message);
  }
  return bundle.bytes();
}

/// A bone of an upright body, above the one before it. VRM asks for these of every avatar.
struct UprightBone {
  const char* name;
  double above_m;
};
constexpr UprightBone kUpright[] = {
    {"Hips", 0.95}, {"Spine", 0.10}, {"Chest", 0.12}, {"Neck", 0.26}, {"Head", 0.10}};

/// The body stands below the head, and its neck takes all turns.
std::vector<std::byte> encode_vmc(const MocapMoment& moment) {
  constexpr double kRoundS = 4096.0;  // steps of a float are a quarter of a millisecond below it
  constexpr uint32_t kIsLoaded = 1;
  const glm::dvec3& p = moment.world_from_head.position_m;
  const glm::dquat& r = moment.world_from_head.rotation;
  double height_m = 0.0;
  for (const UprightBone& bone : kUpright) height_m += bone.above_m;
  Packet is_there;
  is_there.put_text("/VMC/Ext/OK");
  is_there.put_text(",i");
  is_there.put(kIsLoaded, std::endian::big);
  std::vector<std::vector<std::byte>> messages = {
      is_there.bytes(), osc_message("/VMC/Ext/T", "", {std::fmod(moment.time_s, kRoundS)}),
      osc_message("/VMC/Ext/Root/Pos", "root", {-p.x, p.y - height_m, p.z, 0.0, 0.0, 0.0, 1.0})};
  for (const UprightBone& bone : kUpright) {
    const bool is_head = &bone == &std::end(kUpright)[-1];
    const glm::dquat turn = is_head ? r : glm::dquat(1.0, 0.0, 0.0, 0.0);
    messages.push_back(osc_message("/VMC/Ext/Bone/Pos", bone.name,
                                   {0.0, bone.above_m, 0.0, turn.x, -turn.y, -turn.z, turn.w}));
  }
  if (moment.wind_mps)
    messages.push_back(
        osc_message("/strandcast/wind", "", {moment.wind_mps->x, moment.wind_mps->y, moment.wind_mps->z}));
  return osc_bundle(messages);
}

// ---- VRChat: OSC; Unity's axes, and its angles about z, x and y in this order

std::vector<std::byte> encode_vrchat(const MocapMoment& moment) {
  const glm::dvec3& p = moment.world_from_head.position_m;
  const HeadAngles angles = angles_of(moment.world_from_head.rotation);
  return osc_bundle({osc_message("/tracking/trackers/head/position", "", {-p.x, p.y, p.z}),
                     osc_message("/tracking/trackers/head/rotation", "",
                                 {angles.down_deg, -angles.left_deg, -angles.tilt_right_deg})});
}

// ---- OpenTrackIO: a camera; +Z up, it looks along +Y, and turns right-handed about +Z, +X and +Y

std::vector<std::byte> encode_track(const MocapMoment& moment, TrackEncoding encoding) {
  const glm::dvec3& p = moment.world_from_head.position_m;
  const HeadAngles angles = angles_of(moment.world_from_head.rotation);
  const ValueTree document = make_track_document({{-p.x, p.z, p.y},
                                                  {angles.left_deg, -angles.down_deg, angles.tilt_right_deg},
                                                  moment.time_s,
                                                  moment.number,
                                                  moment.rate_hz,
                                                  moment.source,
                                                  moment.timecode,
                                                  moment.is_recording,
                                                  moment.slate});
  std::vector<std::byte> payload;
  if (encoding == TrackEncoding::Cbor) {
    payload = write_cbor(document);
  } else {
    const std::string text = write_json(document);
    const auto bytes = std::as_bytes(std::span(text));
    payload.assign(bytes.begin(), bytes.end());
  }
  TrackSegment segment;
  segment.encoding = static_cast<uint8_t>(encoding);
  segment.sequence = static_cast<uint16_t>(moment.number);
  segment.payload = payload;
  return write_track_segment(segment);
}

constexpr MocapEncoding kEncodings[] = {
    {"vmc", 39539, encode_vmc},
    {"opentrack", 4242, encode_opentrack},
    {"freed", 40000, encode_freed, true, true},
    {"vrchat", 9000, encode_vrchat},
    {"opentrackio", kOpenTrackIoPort,
     [](const MocapMoment& moment) { return encode_track(moment, TrackEncoding::Json); }, true, true},
    {"opentrackio-cbor", kOpenTrackIoPort,
     [](const MocapMoment& moment) { return encode_track(moment, TrackEncoding::Cbor); }, true, true}};

}  // namespace

std::string mocap_encoding_names() {
  std::string names;
  for (const MocapEncoding& encoding : kEncodings)
    names += fmt::format("{}{}", names.empty() ? "" : ", ", encoding.name);
  return names;
}

Result<MocapEncoding> find_mocap_encoding(const std::string& name) {
  for (const MocapEncoding& encoding : kEncodings)
    if (name == encoding.name) return encoding;
  return make_error(ErrorCode::BadInput, "there are no packets of {} (there are: {})", name,
                    mocap_encoding_names());
}

}  // namespace strandcast
