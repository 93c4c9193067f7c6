// Packets of live protocols, written from their documents and not with the parsers' names or conversions:
// numbers go in as the sender has them, in its axes and units.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace strandcast::test {

using PacketBytes = std::vector<std::byte>;
using Triple = std::array<float, 3>;
using Quad = std::array<float, 4>;  // x, y, z, w

/// Appends numbers in the order of bytes that a protocol has.
class PacketWriter {
 public:
  explicit PacketWriter(std::endian order) : order_(order) {}

  template <class T>
  PacketWriter& put(T number) {
    auto bytes = std::bit_cast<std::array<std::byte, sizeof(T)>>(number);
    if (order_ != std::endian::native) std::reverse(bytes.begin(), bytes.end());
    return append(bytes);
  }
  template <class T, size_t kCount>
  PacketWriter& put(const std::array<T, kCount>& numbers) {
    for (const T number : numbers) put(number);
    return *this;
  }
  PacketWriter& text(const std::string& text) {
    for (const char letter : text) bytes_.push_back(static_cast<std::byte>(letter));
    return *this;
  }
  PacketWriter& text_with_nul(const std::string& letters) { return text(letters).put(uint8_t{0}); }
  PacketWriter& append(std::span<const std::byte> more) {
    const size_t size = bytes_.size();
    bytes_.resize(size + more.size());
    std::copy(more.begin(), more.end(), bytes_.begin() + static_cast<ptrdiff_t>(size));
    return *this;
  }
  PacketWriter& fill_to_multiple_of(size_t count) {
    while (bytes_.size() % count != 0) bytes_.push_back(std::byte{0});
    return *this;
  }
  const PacketBytes& bytes() const { return bytes_; }

 private:
  std::endian order_;
  PacketBytes bytes_;
};

using OscValue = std::variant<int32_t, float, std::string>;

inline PacketBytes osc(const std::string& address, const std::vector<OscValue>& values) {
  std::string tags = ",";
  PacketWriter arguments(std::endian::big);
  for (const OscValue& value : values) {
    tags += "ifs"[value.index()];
    if (value.index() == 0) arguments.put(std::get<int32_t>(value));
    if (value.index() == 1) arguments.put(std::get<float>(value));
    if (value.index() == 2) arguments.text_with_nul(std::get<std::string>(value)).fill_to_multiple_of(4);
  }
  return PacketWriter(std::endian::big)
      .text_with_nul(address)
      .fill_to_multiple_of(4)
      .text_with_nul(tags)
      .fill_to_multiple_of(4)
      .append(arguments.bytes())
      .bytes();
}

inline PacketBytes osc_bundle(const std::vector<PacketBytes>& elements) {
  PacketWriter writer(std::endian::big);
  writer.text_with_nul("#bundle").put(uint64_t{1});
  for (const PacketBytes& element : elements)
    writer.put(static_cast<uint32_t>(element.size())).append(element);
  return writer.bytes();
}

/// /VMC/Ext/Bone/Pos and its like: a name and a pose in Unity's axes.
inline PacketBytes vmc_pose(const std::string& address, const std::string& name, const Triple& position_m,
                            const Quad& rotation) {
  std::vector<OscValue> values = {name};
  for (const float number : position_m) values.emplace_back(number);
  for (const float number : rotation) values.emplace_back(number);
  return osc(address, values);
}
inline PacketBytes vmc_bone(const std::string& name, const Triple& position_m, const Quad& rotation) {
  return vmc_pose("/VMC/Ext/Bone/Pos", name, position_m, rotation);
}

/// A bundle with the time, a root and a head bone, so that the head's joint is at `position_m` (Unity's axes:
/// +X to the right, left-handed).
inline PacketBytes vmc_head(const Triple& position_m, const Quad& rotation, float time_s) {
  constexpr float kAboveRootM = 0.25f;
  const Triple root_m = {position_m[0], position_m[1] - kAboveRootM, position_m[2]};
  return osc_bundle({osc("/VMC/Ext/T", {time_s}), vmc_pose("/VMC/Ext/Root/Pos", "root", root_m, {0, 0, 0, 1}),
                     vmc_bone("Head", {0, kAboveRootM, 0}, rotation)});
}

/// World, m/s.
inline PacketBytes osc_wind(const Triple& wind_mps) {
  return osc("/strandcast/wind", {wind_mps[0], wind_mps[1], wind_mps[2]});
}

/// x, y, z in cm, then yaw, pitch, roll in degrees.
inline PacketBytes opentrack(const std::array<double, 6>& values) {
  return PacketWriter(std::endian::little).put(values).bytes();
}

struct FreedPacket {
  uint8_t camera = 1;
  std::array<double, 3> angle_deg{};    // in the packet's order: pan, tilt, roll by the manual
  std::array<double, 3> position_mm{};  // x, y, height
  uint16_t spare = 0;
};
/// Three bytes, the highest first, of two's complement.
inline void put_three(PacketWriter& writer, double number) {
  const auto bits = static_cast<uint32_t>(static_cast<int32_t>(number));
  for (const int shift : {16, 8, 0}) writer.put(static_cast<uint8_t>(bits >> shift));
}
inline PacketBytes freed(const FreedPacket& packet) {
  PacketWriter writer(std::endian::big);
  writer.put(uint8_t{0xD1}).put(packet.camera);
  for (const double angle : packet.angle_deg) put_three(writer, angle * 32768);
  for (const double position : packet.position_mm) put_three(writer, position * 64);
  writer.put(std::array<uint8_t, 6>{}).put(packet.spare);  // zoom and focus before it
  int sum = 0x40;
  for (const std::byte byte : writer.bytes()) sum -= std::to_integer<int>(byte);
  return writer.put(static_cast<uint8_t>(sum & 0xFF)).bytes();
}

/// Trackers of VRChat: where and how the head is, in Unity's axes, m and degrees.
inline PacketBytes vrchat(const Triple& position_m, const Triple& turn_deg,
                          const std::string& name = "head") {
  const auto three = [&](const char* kind, const Triple& value) {
    return osc("/tracking/trackers/" + name + "/" + kind, {value[0], value[1], value[2]});
  };
  return osc_bundle({three("position", position_m), three("rotation", turn_deg)});
}

struct MvnPacketSegment {
  uint32_t number = 1;
  Triple position{};
  std::array<float, 4> rotation = {1, 0, 0, 0};  // w, x, y, z
};
struct MvnPacket {
  uint32_t sample = 1, time_ms = 0;
  uint8_t character = 0;
  std::vector<MvnPacketSegment> segments = {{1, {0, 0, 95}}, {7, {0, 0, 160}}};
  std::string kind = "02";
};
inline PacketBytes mvn(const MvnPacket& packet) {
  PacketWriter writer(std::endian::big);
  writer.text("MXTP" + packet.kind).put(packet.sample).put(uint8_t{0x80});
  writer.put(static_cast<uint8_t>(packet.segments.size())).put(packet.time_ms).put(packet.character);
  writer.put(std::array<uint8_t, 5>{23, 0, 0, 0, 0}).put(static_cast<uint16_t>(32 * packet.segments.size()));
  for (const MvnPacketSegment& segment : packet.segments)
    writer.put(segment.number).put(segment.position).put(segment.rotation);
  return writer.bytes();
}

struct TrackPacketFields {
  uint8_t encoding = 1;  // JSON
  uint16_t sequence = 0;
  uint32_t offset = 0;  // of the payload in its sample
  bool is_last = true;
  uint32_t modulus = 256;
};
/// A segment of OpenTrackIO around a payload, with Fletcher-16 over header and payload: modulo 256
/// since 1.0.1.
inline PacketBytes opentrackio(const std::string& payload, const TrackPacketFields& fields = {}) {
  PacketWriter header(std::endian::big);
  header.text("OTrk").put(uint8_t{0}).put(fields.encoding).put(fields.sequence).put(fields.offset);
  header.put(static_cast<uint16_t>(payload.size() + (fields.is_last ? 0x8000 : 0)));
  const PacketBytes summed = PacketWriter(header).text(payload).bytes();
  uint32_t sum = 0, sums = 0;
  for (const std::byte byte : summed) {
    sum = (sum + std::to_integer<uint32_t>(byte)) % fields.modulus;
    sums = (sums + sum) % fields.modulus;
  }
  header.put(static_cast<uint8_t>(sums)).put(static_cast<uint8_t>(sum));
  return header.text(payload).bytes();
}

struct NatnetPacketBody {
  uint32_t id = 1;
  Triple position_m{};
  Quad rotation = {0, 0, 0, 1};
  bool is_tracked = true;
};
struct NatnetPacket {
  std::string version = "3.1";  // 2.5 to 2.11, 3.0, 3.1, 4.0 or 4.1
  uint32_t frame = 1;
  double time_s = 0;
  std::vector<NatnetPacketBody> bodies;
  std::vector<NatnetPacketBody> bones;  // of one skeleton
  uint32_t skeleton = 5;
  uint16_t flags = 0;          // 2: other models from now on
  bool has_all_kinds = false;  // one marker set, marker, asset, plate and device each
};

inline PacketBytes natnet_message(uint16_t id, const PacketBytes& payload) {
  return PacketWriter(std::endian::little)
      .put(id)
      .put(static_cast<uint16_t>(payload.size()))
      .append(payload)
      .bytes();
}

/// 207 for 2.7, 401 for 4.1: numbers that are in the order of the versions.
inline int natnet_number(const std::string& version) {
  return 100 * std::stoi(version) + std::stoi(version.substr(version.find('.') + 1));
}

inline void put_natnet_body(PacketWriter& writer, const NatnetPacketBody& body, const NatnetPacket& packet) {
  const int number = natnet_number(packet.version);
  writer.put(body.id).put(body.position_m).put(body.rotation);
  if (number < 300 && !packet.has_all_kinds) writer.put(uint32_t{0});
  if (number < 300 && packet.has_all_kinds)  // two markers: places, numbers, sizes
    writer.put(uint32_t{2})
        .put(Triple{1, 2, 3})
        .put(Triple{4, 5, 6})
        .put(std::array<uint32_t, 2>{7, 8})
        .put(std::array<float, 2>{0.01f, 0.02f});
  writer.put(0.0005f);
  if (number >= 206) writer.put(uint16_t{body.is_tracked});
}

/// Time and flags, as each version has them.
inline void put_natnet_end(PacketWriter& frame, const NatnetPacket& packet) {
  const int number = natnet_number(packet.version);
  if (number < 300) frame.put(0.004f);  // latency
  frame.put(uint32_t{0}).put(uint32_t{0});
  if (number >= 207) frame.put(packet.time_s);
  if (number == 206) frame.put(static_cast<float>(packet.time_s));
  if (number >= 300) frame.put(std::array<uint64_t, 3>{1, 2, 3});
  if (number >= 401) frame.put(std::array<uint32_t, 2>{4, 5});
  if (number >= 206) frame.put(packet.flags);
  frame.put(uint32_t{0});
}

/// How many, from 4.1 their bytes, and they themselves.
inline void put_natnet_section(PacketWriter& writer, bool is_sized, size_t count, const PacketWriter& items) {
  writer.put(static_cast<uint32_t>(count));
  if (is_sized) writer.put(static_cast<uint32_t>(items.bytes().size()));
  writer.append(items.bytes());
}

inline PacketBytes natnet(const NatnetPacket& packet) {
  const int number = natnet_number(packet.version);
  const bool is_sized = number >= 401;
  const size_t one = packet.has_all_kinds ? 1 : 0;
  const Triple place = {1, 2, 3};
  const auto little = [] { return PacketWriter(std::endian::little); };
  const auto put_marker = [&](PacketWriter& writer) {
    writer.put(uint32_t{9}).put(place).put(0.02f);
    if (number >= 206) writer.put(uint16_t{10});
    if (number >= 300) writer.put(0.001f);
  };
  PacketWriter marker_sets = little(), markers = little(), bodies = little(), skeletons = little(),
               assets = little(), labelled = little(), channels = little();
  if (packet.has_all_kinds) {
    marker_sets.text_with_nul("all").put(uint32_t{2}).put(place).put(place);
    markers.put(place);
    assets.put(uint32_t{3}).put(uint32_t{1});
    put_natnet_body(assets, {}, packet);
    assets.put(uint32_t{1});
    put_marker(assets);
    put_marker(labelled);
    channels.put(uint32_t{4}).put(uint32_t{2}).put(uint32_t{1}).put(0.5f).put(uint32_t{0});
  }
  for (const NatnetPacketBody& body : packet.bodies) put_natnet_body(bodies, body, packet);
  if (!packet.bones.empty()) skeletons.put(packet.skeleton).put(static_cast<uint32_t>(packet.bones.size()));
  for (NatnetPacketBody bone : packet.bones) {
    bone.id |= packet.skeleton << 16;
    put_natnet_body(skeletons, bone, packet);
  }
  PacketWriter frame = little().put(packet.frame);
  put_natnet_section(frame, is_sized, one, marker_sets);
  put_natnet_section(frame, is_sized, one, markers);
  put_natnet_section(frame, is_sized, packet.bodies.size(), bodies);
  put_natnet_section(frame, is_sized, packet.bones.empty() ? 0 : 1, skeletons);
  if (is_sized) put_natnet_section(frame, is_sized, one, assets);
  put_natnet_section(frame, is_sized, one, labelled);
  if (number >= 209) put_natnet_section(frame, is_sized, one, channels);  // force plates
  if (number >= 211) put_natnet_section(frame, is_sized, one, channels);  // devices
  put_natnet_end(frame, packet);
  return natnet_message(7, frame.bytes());
}

inline PacketBytes natnet_server(uint8_t major, uint8_t minor) {
  PacketWriter writer(std::endian::little);
  writer.text("Motive").append(PacketBytes(256 - 6)).put(std::array<uint8_t, 4>{2, 1, 0, 0});
  writer.put(std::array<uint8_t, 4>{major, minor, 0, 0}).put(uint64_t{3'312'787});
  return natnet_message(
      1, writer.put(uint16_t{1511}).put(uint8_t{1}).put(std::array<uint8_t, 4>{239, 255, 42, 99}).bytes());
}

/// Names of bodies by their numbers, and those of the bones of a skeleton "Actor" of number 5.
inline PacketBytes natnet_names(const std::string& version,
                                const std::vector<std::pair<uint32_t, std::string>>& bodies,
                                const std::vector<std::pair<uint32_t, std::string>>& bones) {
  const bool is_sized = version == "4.1";
  const auto put_body = [&](PacketWriter& writer, uint32_t id, const std::string& name) {
    writer.text_with_nul(name).put(id).put(int32_t{-1}).put(Triple{});
    if (natnet_number(version) < 300) return;
    writer.put(uint32_t{2}).put(Triple{1, 1, 1});
    writer.put(Triple{2, 2, 2}).put(uint32_t{1}).put(uint32_t{2});
    if (version[0] == '4') writer.text_with_nul("first").text_with_nul("second");
  };
  PacketWriter list(std::endian::little);
  list.put(static_cast<uint32_t>(bodies.size() + 3));
  const auto put_description = [&](uint32_t kind, const PacketWriter& description) {
    list.put(kind);
    if (is_sized) list.put(static_cast<uint32_t>(description.bytes().size()));
    list.append(description.bytes());
  };
  PacketWriter markers(std::endian::little), camera(std::endian::little), skeleton(std::endian::little);
  put_description(0, markers.text_with_nul("all").put(uint32_t{1}).text_with_nul("Marker 1"));
  for (const auto& [id, name] : bodies) {
    PacketWriter body(std::endian::little);
    put_body(body, id, name);
    put_description(1, body);
  }
  skeleton.text_with_nul("Actor").put(uint32_t{5}).put(static_cast<uint32_t>(bones.size()));
  for (const auto& [id, name] : bones) put_body(skeleton, id, name);
  put_description(2, skeleton);
  put_description(5, camera.text_with_nul("Camera 1").put(Triple{}).put(Quad{}));
  return natnet_message(5, list.bytes());
}

inline PacketBytes vrpn_cookie() {
  return PacketWriter(std::endian::big).text("vrpn: ver. 07.35  0").fill_to_multiple_of(24).bytes();
}
inline PacketBytes vrpn_message(double time_s, int32_t sender, int32_t type, const PacketBytes& body) {
  const auto seconds = static_cast<int32_t>(time_s);
  PacketWriter writer(std::endian::big);
  writer.put(static_cast<uint32_t>(24 + body.size())).put(seconds);
  writer.put(static_cast<int32_t>((time_s - seconds) * 1e6 + 0.5)).put(sender).put(type).put(uint32_t{0});
  return writer.append(body).fill_to_multiple_of(8).bytes();
}
/// -1 describes a sender, -2 a type.
inline PacketBytes vrpn_description(int32_t kind, int32_t number, const std::string& name) {
  PacketWriter body(std::endian::big);
  body.put(static_cast<uint32_t>(name.size() + 1)).text_with_nul(name);
  return vrpn_message(0, number, kind, body.bytes());
}
inline PacketBytes vrpn_pose(double time_s, int32_t sender, int32_t type, int32_t sensor,
                             const std::array<double, 3>& position_m, const std::array<double, 4>& rotation) {
  PacketWriter body(std::endian::big);
  return vrpn_message(time_s, sender, type,
                      body.put(sensor).put(int32_t{0}).put(position_m).put(rotation).bytes());
}
/// What a server says before its poses: sender 0 is `tracker`, type 3 its poses.
inline PacketBytes vrpn_begin(const std::string& tracker) {
  return PacketWriter(std::endian::big)
      .append(vrpn_cookie())
      .append(vrpn_description(-1, 0, tracker))
      .append(vrpn_description(-2, 2, "vrpn_Base ping_message"))
      .append(vrpn_description(-2, 3, "vrpn_Tracker Pos_Quat"))
      .bytes();
}

struct FacePacketFields {
  std::string device = "5C2F0EE6-8B5A-4A34-9B1D-2C9D0E7F";
  std::string subject = "iPhone";
  int32_t frame = 100;
  int32_t frames_per_second = 60;
  float yaw = 0, pitch = 0, roll = 0;
};
inline PacketBytes live_link_face(const FacePacketFields& fields) {
  PacketWriter writer(std::endian::big);
  writer.put(uint8_t{6});
  for (const std::string& name : {fields.device, fields.subject})
    writer.put(static_cast<int32_t>(name.size())).text(name);
  writer.put(fields.frame).put(0.5f).put(fields.frames_per_second).put(int32_t{1}).put(uint8_t{61});
  for (int i = 0; i < 61; ++i)
    writer.put(i == 52   ? fields.yaw
               : i == 53 ? fields.pitch
               : i == 54 ? fields.roll
                         : 0.01f * static_cast<float>(i));
  return writer.bytes();
}

}  // namespace strandcast::test
