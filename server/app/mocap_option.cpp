#include "server/app/mocap_option.h"

#include <charconv>

#include "common/base/text.h"
#include "common/scene/scene_file.h"

namespace strandcast {
namespace {

constexpr size_t kMaxOptionChars = 100;
constexpr uint32_t kMaxPort = 65'535;
constexpr const char* kCountsInSpareWord = "freed";

Error not_understood(const char* option, const std::string& text, const char* why) {
  return make_error(ErrorCode::BadInput,
                    "{} {}: {}; it is PROTOCOL, PROTOCOL:PORT or PROTOCOL://HOST:PORT, such as vmc, "
                    "opentrack:4242, natnet://10.0.0.5 or vrpn://HOST",
                    option, excerpt(text, kMaxOptionChars), why);
}

/// The port behind a colon.
Result<uint32_t> parse_port(const char* option, const std::string& text, std::string_view digits) {
  uint32_t port = 0;
  const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  if (failure != std::errc{} || end != digits.data() + digits.size() || port == 0 || port > kMaxPort)
    return not_understood(option, text, "its port is not within 1 .. 65535");
  return port;
}

}  // namespace

Result<LiveDesc> parse_mocap(const std::string& text, const char* option) {
  LiveDesc live;
  const size_t scheme = text.find("://");
  std::string rest = scheme == std::string::npos ? text : text.substr(scheme + 3);
  if (scheme != std::string::npos) live.protocol = text.substr(0, scheme);
  // An address of IPv6 stands in brackets.
  const size_t bracket = rest.find(']');
  const size_t colon = rest.rfind(':');
  const bool has_port = colon != std::string::npos && (bracket == std::string::npos || colon > bracket);
  if (has_port) {
    ASSIGN_OR_RETURN(live.port, parse_port(option, text, std::string_view(rest).substr(colon + 1)));
    rest.resize(colon);
  }
  if (scheme == std::string::npos) {
    live.protocol = rest;
  } else {
    live.host = rest.starts_with('[') && rest.ends_with(']') ? rest.substr(1, rest.size() - 2) : rest;
    if (live.host.empty()) return not_understood(option, text, "it names no host");
  }
  if (live.protocol.empty()) return not_understood(option, text, "it names no protocol");
  return live;
}

bool is_live_override(const std::string& assignment) {
  const std::string path = assignment.substr(0, assignment.find('='));
  return path == "live" || path.starts_with("live.");
}

Result<SceneDesc> with_mocap(const SceneDesc& scene, const MocapOptions& options,
                             const std::vector<std::string>& overrides) {
  if (options.inputs.empty()) return scene;
  SceneDesc changed = scene;
  changed.live.clear();
  bool is_counted = false;
  for (const std::string& input : options.inputs) {
    ASSIGN_OR_RETURN(LiveDesc live, parse_mocap(input));
    live.subject = options.subject;
    live.axes = options.axes;
    if (!options.timecode.empty() && live.protocol == kCountsInSpareWord) {
      live.axes += "/" + options.timecode;
      is_counted = true;
    }
    live.scale = options.scale;
    changed.live.push_back(std::move(live));
  }
  if (!options.timecode.empty() && !is_counted)
    return make_error(ErrorCode::BadInput,
                      "--mocap-timecode says how freed counts frames, and no --mocap names it");
  return with_overrides(changed, overrides);
}

}  // namespace strandcast
