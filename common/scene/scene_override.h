// "path=value" overrides on a parsed scene message, by protobuf reflection. Private to common/scene.
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

/// Sets the field that `assignment` ("stream.bound_m=0.0002") names. Elements of lists are named by their
/// index (colliders.0.radius_m), map entries by their key; a group can be given whole as "{ x: 1 y: 2 }".
/// BadInput names the assignment and the known fields; ranges are checked later, with the rest of the scene.
Status apply_override(google::protobuf::Message& scene, const std::string& assignment);

/// "known: a, b, c" for a message's fields.
std::string known_fields(const google::protobuf::Descriptor& descriptor);

/// The path of an assignment: what stands before the first '='.
std::string_view override_path(std::string_view assignment);

}  // namespace strandcast
