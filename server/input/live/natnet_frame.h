// Reads the payloads of OptiTrack's NatNet, versions 2.5 to 4.1: motion frames, names of bodies, and the
// server's description. Follows the layout documented for direct depacketisation; NaturalPoint's SDK is not
// used. Any thread.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace strandcast {

/// A version, which says what the payloads hold.
struct NatnetVersion {
  uint8_t major = 0;
  uint8_t minor = 0;
  auto operator<=>(const NatnetVersion&) const = default;
};
/// Versions from which something is in the payloads, or (kNatnetWithoutMarkers) is not any more.
inline constexpr NatnetVersion kNatnetWithTracking = {2, 6};    // of bodies; a time; flags of a frame
inline constexpr NatnetVersion kNatnetWithDoubleTime = {2, 7};  // before: a float
inline constexpr NatnetVersion kNatnetWithPlates = {2, 9};      // force plates
inline constexpr NatnetVersion kNatnetWithDevices = {2, 11};
inline constexpr NatnetVersion kNatnetWithoutMarkers = {3,
                                                        0};  // of bodies, in frames; descriptions have them
inline constexpr NatnetVersion kNatnetWithMarkerNames = {4, 0};  // in descriptions
inline constexpr NatnetVersion kNatnetSized = {4, 1};            // sections tell their size; assets

struct NatnetBody {
  std::optional<uint32_t> skeleton;  // that it is a bone of
  uint32_t id = 0;
  glm::dvec3 position_m{0.0};
  glm::dvec4 rotation_xyzw{0.0};
  bool is_tracked = false;
};
struct NatnetFrame {
  uint32_t number = 0;
  std::vector<NatnetBody> bodies;
  std::optional<double> time_s;  // since the server's software began; none where it is too coarse
  bool has_new_models = false;
};
/// Reads a frame; empty unless the payload is exactly one frame of this version.
std::optional<NatnetFrame> read_natnet_frame(std::span<const std::byte> payload, NatnetVersion version);

struct NatnetName {
  std::optional<uint32_t> skeleton;
  std::optional<uint32_t> id;  // none: this names the skeleton itself
  std::string name;
};
struct NatnetNames {
  std::vector<NatnetName> names;
  uint64_t unknown = 0;  // descriptions left out
};
std::optional<NatnetNames> read_natnet_names(std::span<const std::byte> payload, NatnetVersion version);

struct NatnetServer {
  std::string name;
  NatnetVersion version;
};
std::optional<NatnetServer> read_natnet_server(std::span<const std::byte> payload);

}  // namespace strandcast
