// Scenario: what to do with a server, in order, and what must hold. Plain data, as
// proto/strandcast/v1/scenario.proto has it; read by scenario_file.h, run by strandcast-ctl test.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace strandcast {

struct ScenarioStart {
  std::filesystem::path scene;  // empty: the built-in scene
  std::vector<std::string> overrides;
  bool is_lockstep = false;
  std::vector<std::string> options;  // further words of the server's command line
  bool has_relay = false;            // between viewers and server
  bool records = false;
};

struct ScenarioFeed {
  std::string motion = "none";  // builtin, shake, still, none or a BVH file
  std::string wind = "none";    // gusts, steady, none or a CSV file
  double from_s = 0.0;
  double shake_mps2 = 98.1;
  double shake_hz = 4.0;
  glm::vec3 wind_mps{1.5f, 0.0f, 1.0f};
  double gust_intensity = 0.6;
};

struct ScenarioSteps {
  uint32_t count = 1;
};
struct ScenarioRunTime {
  double seconds = 1.0;
};
struct ScenarioSet {
  std::string assignment;
};
enum class ScenarioCommand { None, Pause, Resume, Reset, Restart, RestartRelay };

struct ScenarioView {
  std::string name = "viewer";
  std::string mode = "strands";
  double link_mbit = 0.0;  // 0 = as fast as it goes
  double delay_ms = 0.0;
  uint32_t width = 320, height = 240;
  std::string codec;
  std::string draws;     // what it says of itself: hardware, software, none; empty = nothing
  double draw_ms = 0.0;  // likewise; 0 = nothing
};
enum class ScenarioFault { None, Stall, HalfOpen, Cut };
/// The line between a viewer and the server, from now on.
struct ScenarioLink {
  std::string viewer;  // empty: the first
  ScenarioFault fault = ScenarioFault::None;
  double loss = 0.0;  // share of packets that are sent again
  double delay_ms = 0.0;
  double link_mbit = 0.0;  // 0 = as fast as it goes
};
/// Room for files of the server, from now on.
struct ScenarioDisk {
  std::optional<double> full_at_mb;  // none of them grows beyond; empty: as large as they get
};
struct ScenarioLeave {
  std::string viewer;
};
struct ScenarioRemember {
  std::string name;
};

/// Datagrams to a port of the server's machine.
struct ScenarioSend {
  uint16_t port = 0;
  std::vector<std::vector<std::byte>> datagrams;
  std::vector<std::filesystem::path> files;  // each a datagram
  uint32_t random_bytes = 0;                 // of one more each time; 0 = none
  uint32_t count = 1;
  double rate_hz = 100.0;
};

struct ScenarioPicture {
  std::filesystem::path golden;
  double db_above = 40.0;
};
struct ScenarioMetric {
  std::string name;
  std::optional<double> below, above, equals;
  double within_s = 0.0;
};
struct ScenarioExpect {
  std::string viewer;  // empty: the first
  std::optional<double> stretch_below;
  bool has_no_quarantine = false;
  std::optional<uint64_t> hash;
  std::filesystem::path hash_file;  // with a hash; empty: none
  std::string same_as;
  std::optional<ScenarioPicture> picture;
  std::optional<double> kbit_below, bits_per_vertex_below, realtime_above, hz_above, back_within_s;
  std::optional<double> realtime_below, feed_pace_within, head_mps_below;
  std::optional<double> order_above, incoherent_below, cpu_share_below;
  std::optional<bool> is_slow;
  std::string mode;
  std::string because;    // part of the reason for the mode
  double within_s = 0.0;  // is_slow and mode are waited for so long
  std::optional<ScenarioMetric> metric;
};

enum class ScenarioInput { None, WrongToken, WrongRole, WrongMessage, NotANumber, Overlong };
struct ScenarioRefusal {
  ScenarioInput input = ScenarioInput::None;
  std::string assignment;  // instead of an input
  std::string says;
};

using ScenarioWork =
    std::variant<ScenarioStart, ScenarioFeed, ScenarioSteps, ScenarioRunTime, ScenarioSet, ScenarioCommand,
                 ScenarioView, ScenarioLeave, ScenarioExpect, ScenarioRefusal, ScenarioRemember, ScenarioSend,
                 ScenarioLink, ScenarioDisk>;

struct ScenarioAction {
  ScenarioWork work;
  int line = 0;  // of the file, from 1
};

struct Scenario {
  std::string name;
  std::filesystem::path folder;  // of its file
  std::string about;
  double limit_s = 120.0;
  uint32_t repeat = 1;
  std::vector<ScenarioAction> actions;
};

}  // namespace strandcast
