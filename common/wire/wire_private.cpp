#include "common/wire/wire_private.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message_lite.h>
#include <google/protobuf/stubs/logging.h>

#include <cmath>

#include "common/base/check.h"
#include "common/strands/frame_header.h"
#include "strandcast/v1/scene.pb.h"

namespace strandcast {
namespace {

constexpr int kMaxNesting = 16;

bool is_control_character(unsigned char byte) {
  return byte < 0x20 || byte == 0x7f;
}
bool is_continuation(unsigned char byte) {
  return (byte & 0xc0) == 0x80;
}

template <class Message>
void put_vector(const glm::vec3& value, Message& message) {
  message.set_x(value.x);
  message.set_y(value.y);
  message.set_z(value.z);
}

void put_color(const glm::vec3& value, v1::Color& message) {
  message.set_r(value.r);
  message.set_g(value.g);
  message.set_b(value.b);
}

glm::vec3 take_vector(const v1::Vec3& message, const glm::vec3& missing) {
  return {message.has_x() ? static_cast<float>(message.x()) : missing.x,
          message.has_y() ? static_cast<float>(message.y()) : missing.y,
          message.has_z() ? static_cast<float>(message.z()) : missing.z};
}

glm::vec3 take_color(const v1::Color& message, const glm::vec3& missing) {
  return {message.has_r() ? static_cast<float>(message.r()) : missing.r,
          message.has_g() ? static_cast<float>(message.g()) : missing.g,
          message.has_b() ? static_cast<float>(message.b()) : missing.b};
}

}  // namespace

std::vector<std::byte> pack_control(const google::protobuf::MessageLite& message) {
  std::vector<std::byte> bytes(1 + message.ByteSizeLong());
  bytes[0] = static_cast<std::byte>(Opcode::Control);
  CHECK(message.SerializeToArray(bytes.data() + 1, static_cast<int>(bytes.size() - 1)));
  return bytes;
}

Status parse_control(std::span<const std::byte> bytes, google::protobuf::MessageLite& message) {
  if (bytes.size() > kMaxControlBytes)
    return make_error(ErrorCode::LimitExceeded, "control message has {} bytes, the limit is {}", bytes.size(),
                      kMaxControlBytes);
  if (bytes.empty()) return make_error(ErrorCode::BadInput, "control message is empty");
  if (bytes[0] != static_cast<std::byte>(Opcode::Control))
    return make_error(ErrorCode::BadInput, "control message begins with opcode 0x{:02x}, expected 0x01",
                      static_cast<int>(bytes[0]));
  // Hostile bytes must not fill the log: protobuf would print a line for each.
  [[maybe_unused]] static auto* const previous_handler = google::protobuf::SetLogHandler(nullptr);
  const auto body = bytes.subspan(1);
  google::protobuf::io::ArrayInputStream array(body.data(), static_cast<int>(body.size()));
  google::protobuf::io::CodedInputStream stream(&array);
  stream.SetRecursionLimit(kMaxNesting);
  stream.SetTotalBytesLimit(static_cast<int>(kMaxControlBytes));
  if (!message.ParseFromCodedStream(&stream) || !stream.ConsumedEntireMessage())
    return make_error(ErrorCode::BadInput, "control message of {} bytes is not valid protobuf", bytes.size());
  return {};
}

void FieldCheck::fail(const char* field, Error error) {
  if (!error_) error_ = at(field, std::move(error));
}

void FieldCheck::number(const char* field, double value, const scene_fields::Range& range) {
  // Ranges are doubles; a float at the end of one may lie a rounding outside.
  constexpr double kSlack = 1e-6;
  const double low = range.minimum - kSlack * std::abs(range.minimum);
  const double high = range.maximum + kSlack * std::abs(range.maximum);
  if (value >= low && value <= high) return;
  fail(field, make_error(ErrorCode::BadInput, "is {}, it must be within {:g} .. {:g}{}{}", value,
                         range.minimum, range.maximum, *range.unit ? " " : "", range.unit));
}

void FieldCheck::vector(const char* field, const glm::vec3& value, const scene_fields::Range& range) {
  for (int axis = 0; axis < 3; ++axis) number(field, value[axis], range);
}

void FieldCheck::direction(const char* field, const glm::vec3& value) {
  vector(field, value, scene_fields::kDirection);
  if (glm::length(value) < scene_fields::kMinDirectionLength)
    fail(field, make_error(ErrorCode::BadInput, "is almost zero, it must be at least {:g} long",
                           scene_fields::kMinDirectionLength));
}

void FieldCheck::measure(const char* field, double value) {
  if (!std::isfinite(value) || value < 0.0)
    fail(field, make_error(ErrorCode::BadInput, "is {}, it must be finite and not negative", value));
}

void FieldCheck::frame_side(const char* field, uint32_t value, const scene_fields::Range& range) {
  if (value != 0) number(field, value, range);
}

void FieldCheck::text(const char* field, const std::string& value, size_t limit) {
  size_t chars = 0;
  for (const char character : value) {
    const auto byte = static_cast<unsigned char>(character);
    chars += is_continuation(byte) ? 0 : 1;
    if (is_control_character(byte))
      return fail(field, make_error(ErrorCode::BadInput, "holds the unprintable character 0x{:02x}", byte));
  }
  count(field, chars, limit);
}

void FieldCheck::count(const char* field, size_t value, size_t limit) {
  if (value > limit)
    fail(field, make_error(ErrorCode::LimitExceeded, "has length {}, the limit is {}", value, limit));
}

void put(const CameraDesc& camera, v1::Camera& message) {
  put_vector(camera.offset_m, *message.mutable_offset_m());
  put_vector(camera.target_m, *message.mutable_target_m());
  message.set_fov_y_rad(camera.fov_y_rad);
}

void put(const LookDesc& look, v1::Look& message) {
  put_color(look.root_color, *message.mutable_root_color());
  put_color(look.tip_color, *message.mutable_tip_color());
  message.set_strand_radius_m(look.strand_radius_m);
  message.set_tip_scale(look.tip_scale);
  message.set_followers(look.followers);
  message.set_segments(look.segments);
  put_vector(look.light_direction, *message.mutable_light_direction());
  put_color(look.light_color, *message.mutable_light_color());
  message.set_ambient(look.ambient);
  put_color(look.background, *message.mutable_background());
  put_color(look.skin_color, *message.mutable_skin_color());
}

CameraDesc take_camera(const v1::Camera& message, FieldCheck& check) {
  CameraDesc camera;
  camera.offset_m = take_vector(message.offset_m(), camera.offset_m);
  camera.target_m = take_vector(message.target_m(), camera.target_m);
  if (message.has_fov_y_rad()) camera.fov_y_rad = message.fov_y_rad();
  check.vector("camera.offset_m", camera.offset_m, scene_fields::kCameraOffset);
  check.direction("camera.offset_m", camera.offset_m);
  check.vector("camera.target_m", camera.target_m, scene_fields::kCameraOffset);
  check.number("camera.fov_y_rad", camera.fov_y_rad, scene_fields::kFieldOfView);
  return camera;
}

LookDesc take_look(const v1::Look& message, FieldCheck& check) {
  LookDesc look;
  look.root_color = take_color(message.root_color(), look.root_color);
  look.tip_color = take_color(message.tip_color(), look.tip_color);
  if (message.has_strand_radius_m()) look.strand_radius_m = message.strand_radius_m();
  if (message.has_tip_scale()) look.tip_scale = message.tip_scale();
  if (message.has_followers()) look.followers = message.followers();
  if (message.has_segments()) look.segments = message.segments();
  look.light_direction = take_vector(message.light_direction(), look.light_direction);
  look.light_color = take_color(message.light_color(), look.light_color);
  if (message.has_ambient()) look.ambient = message.ambient();
  look.background = take_color(message.background(), look.background);
  look.skin_color = take_color(message.skin_color(), look.skin_color);
  check.vector("look.root_color", look.root_color, scene_fields::kFraction);
  check.vector("look.tip_color", look.tip_color, scene_fields::kFraction);
  check.number("look.strand_radius_m", look.strand_radius_m, scene_fields::kDrawnRadius);
  check.number("look.tip_scale", look.tip_scale, scene_fields::kFraction);
  check.number("look.followers", look.followers, scene_fields::kFollowers);
  check.number("look.segments", look.segments, scene_fields::kSegments);
  check.direction("look.light_direction", look.light_direction);
  check.vector("look.light_color", look.light_color, scene_fields::kLightColor);
  check.number("look.ambient", look.ambient, scene_fields::kFraction);
  check.vector("look.background", look.background, scene_fields::kFraction);
  check.vector("look.skin_color", look.skin_color, scene_fields::kFraction);
  return look;
}

}  // namespace strandcast
