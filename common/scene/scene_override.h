// Applies "path=value" overrides to a parsed scene message by protobuf reflection. Private to common/scene.
#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"

namespace google::protobuf {
class Descriptor;
class Message;
}  // namespace google::protobuf

namespace strandcast {

inline constexpr size_t kMaxOverrideBytes = 16u << 10;

/// Sets the field that `assignment` ("stream.bound_m=0.0002") names. List elements are named by index
/// (colliders.0.radius_m), map entries by key. A group can be assigned whole as "{ x: 1 y: 2 }". BadInput
/// names the assignment and the known fields; ranges are checked later, with the rest of the scene.
Status apply_override(google::protobuf::Message& scene, const std::string& assignment);

/// Lists a message's fields: "known: a, b, c".
std::string known_fields(const google::protobuf::Descriptor& descriptor);

/// Returns the path of an assignment: the text before the first '='.
std::string_view override_path(std::string_view assignment);

}  // namespace strandcast
