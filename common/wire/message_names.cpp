#include "common/wire/messages.h"

namespace strandcast {

std::string codec_text(const Welcome& welcome) {
  return welcome.codec_reason.empty() ? welcome.codec : welcome.codec_reason;
}

// schema begin: names
// clang-format off
const char* to_string(Role value) {
  switch (value) {
    case Role::Viewer:
      return "viewer";
    case Role::Controller:
      return "controller";
    case Role::Source:
      return "source";
    case Role::Admin:
      return "admin";
  }
  return "unknown";
}
const char* to_string(StreamMode value) {
  switch (value) {
    case StreamMode::Strands:
      return "strands";
    case StreamMode::Frames:
      return "frames";
    case StreamMode::Auto:
      return "auto";
  }
  return "unknown";
}
const char* to_string(DrawingDevice value) {
  switch (value) {
    case DrawingDevice::Unknown:
      return "unknown";
    case DrawingDevice::None:
      return "none";
    case DrawingDevice::Software:
      return "software";
    case DrawingDevice::Hardware:
      return "hardware";
  }
  return "unknown";
}
// clang-format on
// schema end

}  // namespace strandcast
