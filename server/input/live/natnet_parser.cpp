// OptiTrack's NatNet: rigid bodies and bones (`Actor/Head`) by their names, from multicast or from a server
// that was asked; the layout for direct depacketisation. Axes are `y-up` or `z-up`. The version is as set,
// else the server's, else what fits to the last byte.
#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <string_view>
#include <utility>

#include "common/strands/byte_io.h"
#include "server/input/live/conventions.h"
#include "server/input/live/natnet_frame.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

enum Message : uint16_t {
  kConnect = 0,
  kServerInfo = 1,
  kRequestModels = 4,
  kModels = 5,
  kFrame = 7,
  kKeepAlive = 10,
};

struct Version {
  const char* name;
  NatnetVersion number;
};
/// The newest first: what fits is looked for in this order.
constexpr Version kVersions[] = {
    {"4.1", {4, 1}}, {"4.0", {4, 0}}, {"3.1", {3, 1}}, {"3.0", {3, 0}}, {"2.11", {2, 11}}, {"2.10", {2, 10}},
    {"2.9", {2, 9}}, {"2.8", {2, 8}}, {"2.7", {2, 7}}, {"2.6", {2, 6}}, {"2.5", {2, 5}},
};

std::vector<std::byte> message_of(Message id, std::span<const std::byte> payload) {
  constexpr size_t kHeaderBytes = 2 * sizeof(uint16_t);
  const std::array<uint16_t, 2> header = {id, static_cast<uint16_t>(payload.size())};
  std::vector<std::byte> bytes(kHeaderBytes + payload.size());
  std::memcpy(bytes.data(), header.data(), kHeaderBytes);
  std::copy(payload.begin(), payload.end(), bytes.begin() + kHeaderBytes);
  return bytes;
}

/// Bones are keyed by their skeleton too, skeletons by itself alone.
using BodyKey = std::pair<std::optional<uint32_t>, std::optional<uint32_t>>;

class NatnetParser : public LiveParser {
 public:
  NatnetParser(SystemUp up, std::optional<Version> version) : up_(up), version_(version) {}

  Result<LivePacket> parse(std::span<const std::byte> bytes, int64_t) override {
    ByteReader reader(bytes);
    const auto id = reader.take<uint16_t>();
    (void)reader.take<uint16_t>();  // the size again; servers do not agree on what it counts
    if (!reader.ok())
      return make_error(ErrorCode::BadInput, "a packet of NatNet begins with 4 bytes and this one has {}",
                        bytes.size());
    switch (id) {
      case kFrame:
        return parse_frame(reader.rest());
      case kModels:
        return parse_names(reader.rest());
      case kServerInfo:
        return parse_server(reader.rest());
      default:
        ++ignored_;
        return LivePacket{};
    }
  }

  std::vector<std::byte> greeting() const override {
    // Who asks, its versions, and then which bitstream it reads.
    constexpr size_t kNameBytes = 256, kBytes = 270, kBitstreamAt = 265;
    const Version& version = version_ ? *version_ : kVersions[0];
    std::vector<std::byte> payload(kBytes);
    constexpr std::string_view kName = "Strandcast";
    std::memcpy(payload.data(), kName.data(), kName.size());
    for (const size_t at : {kNameBytes, kNameBytes + 4, kBitstreamAt}) {
      payload[at] = std::byte{version.number.major};
      payload[at + 1] = std::byte{version.number.minor};
    }
    return message_of(kConnect, payload);
  }

  std::vector<std::byte> request() const override {
    if (!server_) return greeting();
    return message_of(has_names_ ? kKeepAlive : kRequestModels, {});
  }

  uint64_t ignored() const override { return ignored_; }

  std::vector<std::string> describe() const override {
    MonitorLines lines;
    if (server_)
      lines.add(fmt::format("server \"{}\", NatNet {}.{}", server_->name, server_->version.major,
                            server_->version.minor));
    if (!last_) return std::move(lines).take();
    lines.add(last_->time_s ? fmt::format("frame {} at {:.4f} s", last_->number, *last_->time_s)
                            : fmt::format("frame {}", last_->number));
    for (const NatnetBody& body : last_->bodies) {
      const glm::dvec3& p = body.position_m;
      const glm::dvec4& q = body.rotation_xyzw;
      lines.add(
          lines.has_room()
              ? fmt::format("{}{}: x {:.4f} y {:.4f} z {:.4f} m, quaternion {:.4f} {:.4f} {:.4f} {:.4f}",
                            subject_of(body), body.is_tracked ? "" : " (not tracked)", p.x, p.y, p.z, q.x,
                            q.y, q.z, q.w)
              : "");
    }
    return std::move(lines).take();
  }

 private:
  /// Tries what was set, or what the server says, then what else there is.
  template <class Read>
  auto read_as_fits(Read read) const -> decltype(read(NatnetVersion{})) {
    if (version_) return read(version_->number);
    if (server_)
      if (auto found = read(server_->version)) return found;
    for (const Version& version : kVersions)
      if (auto found = read(version.number)) return found;
    return std::nullopt;
  }
  Error no_fit(const char* what) const {
    const std::string server =
        server_ ? fmt::format("; its server says {}.{}", server_->version.major, server_->version.minor) : "";
    return make_error(ErrorCode::BadInput, "{} of NatNet is cut, or not of version {}{}", what,
                      version_ ? version_->name : "2.5 to 4.1", server);
  }

  Result<LivePacket> parse_frame(std::span<const std::byte> payload) {
    auto frame = read_as_fits([&](NatnetVersion version) { return read_natnet_frame(payload, version); });
    if (!frame) return no_fit("a frame");
    LivePacket packet;
    for (const NatnetBody& body : frame->bodies) {
      if (!body.is_tracked) continue;
      LivePose& pose = packet.poses.emplace_back();
      pose.subject = subject_of(body);
      pose.world_from_subject = pose_from_system(up_, body.position_m, quaternion_of(body.rotation_xyzw));
      if (frame->time_s) pose.source_time_ns = nanoseconds_of(*frame->time_s);
      pose.frame = frame->number;
      pose.body = (body.skeleton ? *body.skeleton + uint64_t{1} : 0) << 32 | body.id;
    }
    if (frame->has_new_models) has_names_ = false;
    last_ = std::move(*frame);
    return packet;
  }

  Result<LivePacket> parse_names(std::span<const std::byte> payload) {
    const auto found =
        read_as_fits([&](NatnetVersion version) { return read_natnet_names(payload, version); });
    if (!found) return no_fit("a list of bodies");
    names_.clear();
    for (const NatnetName& name : found->names) names_[{name.skeleton, name.id}] = name.name;
    ignored_ += found->unknown;
    has_names_ = true;
    return LivePacket{};
  }

  Result<LivePacket> parse_server(std::span<const std::byte> payload) {
    auto server = read_natnet_server(payload);
    if (!server)
      return make_error(ErrorCode::BadInput, "a server's answer of NatNet that is cut after {} bytes",
                        payload.size());
    server_ = std::move(*server);
    return LivePacket{};
  }

  std::string name_of(const BodyKey& key, uint32_t id) const {
    const auto found = names_.find(key);
    return found != names_.end() && !found->second.empty() ? found->second : fmt::format("{}", id);
  }
  std::string subject_of(const NatnetBody& body) const {
    if (!body.skeleton) return name_of({std::nullopt, body.id}, body.id);
    constexpr uint32_t kBoneMask = 0xFFFF;  // in frames a bone's number stands below its skeleton's
    const uint32_t bone = body.id & kBoneMask;
    return name_of({body.skeleton, std::nullopt}, *body.skeleton) + "/" +
           name_of({body.skeleton, bone}, bone);
  }

  SystemUp up_;
  std::optional<Version> version_;  // as it was set
  std::optional<NatnetServer> server_;
  std::map<BodyKey, std::string> names_;
  bool has_names_ = false;
  std::optional<NatnetFrame> last_;
  uint64_t ignored_ = 0;
};

}  // namespace

Result<std::unique_ptr<LiveParser>> make_natnet_parser(size_t axis_order, const std::string& version) {
  const SystemUp up = axis_order == 0 ? SystemUp::Y : SystemUp::Z;
  if (version.empty()) return std::unique_ptr<LiveParser>(std::make_unique<NatnetParser>(up, std::nullopt));
  std::vector<const char*> names;
  for (const Version& known : kVersions) names.push_back(known.name);
  ASSIGN_OR_RETURN(const size_t index, find_name("version of NatNet", version, names));
  return std::unique_ptr<LiveParser>(std::make_unique<NatnetParser>(up, kVersions[index]));
}

}  // namespace strandcast
