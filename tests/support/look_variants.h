// Looks that are one field apart: whoever treats a field otherwise than the rest is found by walking them.
#pragma once

#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "common/scene/scene_fields.h"

namespace strandcast::test {

/// Reads all fields of a look, or writes one of them.
class LookWalker {
 public:
  using Value = std::variant<double, glm::vec3, std::string>;
  using Range = scene_fields::Range;

  /// Reads.
  LookWalker() = default;
  /// Puts `value` into field number `index`.
  LookWalker(size_t index, Value value) : index_(index), value_(std::move(value)), writes_(true) {}

  template <class T>
  void number(const char* name, T& field, const Range&) {
    if (is_written(name, static_cast<double>(field))) field = static_cast<T>(std::get<double>(value_));
  }
  void vector(const char* name, glm::vec3& field, const Range&) {
    if (is_written(name, field)) field = std::get<glm::vec3>(value_);
  }
  void color(const char* name, glm::vec3& field, const Range& range) { vector(name, field, range); }
  void text(const char* name, std::string& field, size_t) {
    if (is_written(name, field)) field = std::get<std::string>(value_);
  }
  template <class Body>
  void group(const char* name, Body body) {
    const std::string outer = group_;
    group_.append(name).append(".");
    body();
    group_ = outer;
  }
  void require(const char*, bool, const char*) {}

  std::vector<std::pair<std::string, Value>> fields;  // path and value of each

 private:
  bool is_written(const char* name, Value present) {
    fields.emplace_back(group_ + name, std::move(present));
    return writes_ && fields.size() == index_ + 1;
  }

  size_t index_ = 0;
  Value value_;
  bool writes_ = false;
  std::string group_;
};

inline std::vector<std::pair<std::string, LookWalker::Value>> fields_of(LookDesc look) {
  LookWalker walker;
  scene_fields::visit_look(walker, look);
  return walker.fields;
}

/// For every field: its path, and `base` with this field as in `other`.
inline std::vector<std::pair<std::string, LookDesc>> looks_one_field_apart(const LookDesc& base,
                                                                           const LookDesc& other) {
  std::vector<std::pair<std::string, LookDesc>> looks;
  for (const auto& [path, value] : fields_of(other)) {
    LookDesc look = base;
    LookWalker writer(looks.size(), value);
    scene_fields::visit_look(writer, look);
    looks.emplace_back(path, look);
  }
  return looks;
}

}  // namespace strandcast::test
