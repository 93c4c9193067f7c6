// Reads the payloads of OptiTrack's NatNet, versions 3.0 to 4.1: motion frames, names of bodies, and the
// server's description. Follows the layout documented for direct depacketisation; NaturalPoint's SDK is not
// used. Any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace strandcast {

/// Layouts of NatNet versions; each includes the features of the preceding ones.
enum class NatnetLayout {
  Plain,        // 3.0, 3.1
  MarkerNames,  // 4.0: descriptions name markers
  Sized,        // 4.1: every section tells its size; assets; a second time
};

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
  double time_s = 0.0;  // since the server's software began
  bool has_new_models = false;
};
/// Reads a frame; empty unless the payload is exactly one frame of this layout. MarkerNames is read like
/// Plain.
std::optional<NatnetFrame> read_natnet_frame(std::span<const std::byte> payload, NatnetLayout layout);

struct NatnetName {
  std::optional<uint32_t> skeleton;
  std::optional<uint32_t> id;  // none: this names the skeleton itself
  std::string name;
};
struct NatnetNames {
  std::vector<NatnetName> names;
  uint64_t unknown = 0;  // descriptions left out
};
std::optional<NatnetNames> read_natnet_names(std::span<const std::byte> payload, NatnetLayout layout);

struct NatnetServer {
  std::string name;
  uint8_t major = 0;
  uint8_t minor = 0;
};
std::optional<NatnetServer> read_natnet_server(std::span<const std::byte> payload);

}  // namespace strandcast
