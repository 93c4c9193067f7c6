// What the two message files share: packing, parsing with limits, and checks of single fields. Private to
// common/wire.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/text.h"
#include "common/scene/scene_fields.h"
#include "common/wire/messages.h"

namespace google::protobuf {
class MessageLite;
}
namespace strandcast::v1 {
class Camera;
class Look;
}  // namespace strandcast::v1

namespace strandcast {

/// Opcode byte and serialised message.
std::vector<std::byte> pack_control(const google::protobuf::MessageLite& message);

/// Checks length and opcode, then parses; `message` is valid only after success.
Status parse_control(std::span<const std::byte> bytes, google::protobuf::MessageLite& message);

/// Keeps the first field that is wrong.
class FieldCheck {
 public:
  Status status() const { return error_ ? Status(*error_) : Status(); }
  void fail(const char* field, Error error);

  void number(const char* field, double value, const scene_fields::Range& range);
  void vector(const char* field, const glm::vec3& value, const scene_fields::Range& range);
  void direction(const char* field, const glm::vec3& value);
  /// A time or rate: finite and not negative.
  void measure(const char* field, double value);
  /// Picture size: 0 or within its range.
  void frame_side(const char* field, uint32_t value, const scene_fields::Range& range);
  /// Printable text (proto3 has checked that it is UTF-8) of at most `limit` characters.
  void text(const char* field, const std::string& value, size_t limit);
  void count(const char* field, size_t value, size_t limit);
  template <class Enum>
  Enum choice(const char* field, int value, int first, Enum last) {
    const int end = first + static_cast<int>(last);
    if (value >= first && value <= end) return static_cast<Enum>(value - first);
    fail(field, make_error(ErrorCode::BadInput, "is {}, known are {}..{}", value, first, end));
    return Enum{};
  }

 private:
  std::optional<Error> error_;
};

void put(const CameraDesc& camera, v1::Camera& message);
void put(const LookDesc& look, v1::Look& message);
CameraDesc take_camera(const v1::Camera& message, FieldCheck& check);
LookDesc take_look(const v1::Look& message, FieldCheck& check);

}  // namespace strandcast
