// Visitors of the field lists: they write messages, and read and check them. Private to common/wire. Shared
// by wire messages (messages.cpp) and recordings (recording_messages.cpp).
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/check.h"
#include "common/base/text.h"
#include "common/base/timecode.h"
#include "common/wire/message_fields_private.h"

namespace strandcast {

namespace pb = google::protobuf;
using scene_fields::Range;
using wire_fields::kKind;

/// A message with its descriptor and reflection, which are cached because protobuf takes long to look them
/// up.
template <class Message>
struct Place {
  explicit Place(Message& m) : message(&m), type(m.GetDescriptor()), reflection(m.GetReflection()) {}

  Message* message;
  const pb::Descriptor* type;
  const pb::Reflection* reflection;
};
using PlaceToWrite = Place<pb::Message>;
using PlaceToRead = Place<const pb::Message>;

/// A field of a message; `name` and `type` are what it was found by.
struct FoundField {
  const char* name = nullptr;
  const pb::Descriptor* type = nullptr;
  const pb::FieldDescriptor* descriptor = nullptr;
  bool may_be_missing = false;  // and then keeps its default; what cannot be is 0
};

/// Finds a field by its name, which must be a literal: each thread remembers by its address what it has
/// found, since protobuf takes longer to find a field than to read it.
inline const FoundField& find_field(const pb::Descriptor* type, const char* name) {
  constexpr size_t kRemembered = 2048;  // some times as many as there are fields
  thread_local std::array<FoundField, kRemembered> remembered;
  constexpr uintptr_t kMix = 0x9e3779b97f4a7c15u;  // 2^64 over the golden ratio
  const uintptr_t key = (reinterpret_cast<uintptr_t>(type) + reinterpret_cast<uintptr_t>(name)) * kMix;
  FoundField& field = remembered[key >> (8 * sizeof(key) - 11)];
  static_assert(kRemembered == 1u << 11);
  if (field.name == name && field.type == type) return field;
  const auto* descriptor = type->FindFieldByName(name);
  CHECK(descriptor != nullptr);
  return field = {name, type, descriptor, descriptor->has_presence()};
}

using PartNames = std::array<const char*, 3>;
constexpr PartNames kVectorParts = {"x", "y", "z"};
constexpr PartNames kColorParts = {"r", "g", "b"};

/// Writes all visited fields into a message.
class MessageWriter {
 public:
  explicit MessageWriter(pb::Message& message) : at_(message) {}

  template <class T>
  void value(const char* name, const T& value) {
    const auto& field = field_of(name);
    switch (field.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_DOUBLE:
        return at_.reflection->SetDouble(at_.message, &field, static_cast<double>(value));
      case pb::FieldDescriptor::CPPTYPE_FLOAT:
        return at_.reflection->SetFloat(at_.message, &field, static_cast<float>(value));
      case pb::FieldDescriptor::CPPTYPE_INT64:
        return at_.reflection->SetInt64(at_.message, &field, static_cast<int64_t>(value));
      case pb::FieldDescriptor::CPPTYPE_UINT64:
        return at_.reflection->SetUInt64(at_.message, &field, static_cast<uint64_t>(value));
      case pb::FieldDescriptor::CPPTYPE_BOOL:
        return at_.reflection->SetBool(at_.message, &field, static_cast<bool>(value));
      default:
        return at_.reflection->SetUInt32(at_.message, &field, static_cast<uint32_t>(value));
    }
  }
  template <class T>
  void number(const char* name, const T& number, const Range&) {
    value(name, number);
  }
  void measure(const char* name, double number) { value(name, number); }
  void side(const char* name, uint32_t number, const Range&) { value(name, number); }
  template <class Enum>
  void choice(const char* name, Enum chosen, Enum, int first = 0) {
    at_.reflection->SetEnumValue(at_.message, &field_of(name), first + static_cast<int>(chosen));
  }
  void text(const char* name, const std::string& value, size_t limit) {
    exact_text(name, printable(value, limit), limit);
  }
  void exact_text(const char* name, const std::string& value, size_t) {
    at_.reflection->SetString(at_.message, &field_of(name), value);
  }
  void secret(const char* name, const std::string& value, size_t limit) { exact_text(name, value, limit); }
  void vector(const char* name, const glm::vec3& value, const Range&) { parts(name, value, kVectorParts); }
  void color(const char* name, const glm::vec3& value, const Range&) { parts(name, value, kColorParts); }
  template <class Body>
  void group(const char* name, Body body) {
    descend(PlaceToWrite(*at_.reflection->MutableMessage(at_.message, &field_of(name))), body);
  }
  template <class T, class Body>
  void repeated(const char* name, std::vector<T>& values, size_t, Body body) {
    const auto& field = field_of(name);
    std::optional<PlaceToWrite> place;
    for (T& value : values) {
      pb::Message& element = *at_.reflection->AddMessage(at_.message, &field);
      if (place)
        place->message = &element;  // all of one type
      else
        place.emplace(element);
      descend(*place, [&] { body(value); });
    }
  }
  void places(const char* name, const std::vector<glm::vec3>& values, size_t) {
    if (values.empty()) return;
    const auto& field = field_of(name);
    for (const glm::vec3& value : values)
      for (int axis = 0; axis < 3; ++axis) at_.reflection->AddFloat(at_.message, &field, value[axis]);
  }
  void places(const char* name, const std::vector<glm::dvec3>& values, size_t) {
    if (values.empty()) return;
    const auto& field = field_of(name);
    for (const glm::dvec3& value : values)
      for (int axis = 0; axis < 3; ++axis) at_.reflection->AddDouble(at_.message, &field, value[axis]);
  }
  void timecode(const char* name, const std::optional<Timecode>& timecode) {
    if (!timecode) return;
    group(name, [&] {
      value("rate_numerator", timecode->rate.numerator);
      value("rate_denominator", timecode->rate.denominator);
      value("is_drop", timecode->is_drop);
      value("frame", timecode->frame);
      value("part", timecode->part);
    });
  }
  template <class Variant>
  void one_of(const char*, const Variant& whole) {
    std::visit(
        [&](auto kind) {  // a copy: the list of fields is shared with the reader, which writes
          group(kKind<decltype(kind)>, [&] { wire_fields::visit(*this, kind); });
        },
        whole);
  }
  void names(const char* name, const std::vector<std::string>& values, size_t, size_t) {
    for (const std::string& value : values) at_.reflection->AddString(at_.message, &field_of(name), value);
  }
  void require(const char*, bool, const char*) {}

 private:
  const pb::FieldDescriptor& field_of(const char* name) { return *find_field(at_.type, name).descriptor; }

  void parts(const char* name, const glm::vec3& whole, const PartNames& names) {
    group(name, [&] {
      for (int i = 0; i < 3; ++i) value(names[static_cast<size_t>(i)], whole[i]);
    });
  }
  template <class Body>
  void descend(const PlaceToWrite& inner, Body body) {
    const PlaceToWrite outer = std::exchange(at_, inner);
    body();
    at_ = outer;
  }

  PlaceToWrite at_;
};

/// Reads fields from a message and checks them; keeps the first error, which names the field and its group.
class MessageReader {
 public:
  explicit MessageReader(const pb::Message& message) : at_(message) {}

  Status status() const { return error_ ? Status(*error_) : Status(); }

  template <class T>
  void value(const char* name, T& value) {
    const FoundField& field = find_field(at_.type, name);
    if (is_given(field)) value = static_cast<T>(get<T>(*field.descriptor));
  }
  template <class T>
  void number(const char* name, T& value, const Range& range) {
    const FoundField& field = find_field(at_.type, name);
    const auto given = is_given(field) ? get<T>(*field.descriptor) : value;
    value = static_cast<T>(given);
    check(name, static_cast<double>(given), range);
  }
  void measure(const char* name, double& number) {
    value(name, number);
    if (!std::isfinite(number) || number < 0.0)
      fail(name, make_error(ErrorCode::BadInput, "is {}, it must be finite and not negative", number));
  }
  void side(const char* name, uint32_t& pixels, const Range& range) {
    value(name, pixels);
    if (pixels != 0) check(name, pixels, range);
  }
  template <class Enum>
  void choice(const char* name, Enum& value, Enum last, int first = 0) {
    const int given = at_.reflection->GetEnumValue(*at_.message, &field_of(name));
    const int end = first + static_cast<int>(last);
    if (given < first || given > end)
      return fail(name, make_error(ErrorCode::BadInput, "is {}, known are {}..{}", given, first, end));
    value = static_cast<Enum>(given - first);
  }
  void text(const char* name, std::string& value, size_t limit) {
    const FoundField& field = find_field(at_.type, name);
    if (!is_given(field)) return;
    value = at_.reflection->GetString(*at_.message, field.descriptor);
    check_printable(name, value);
    // The parser has checked that it is UTF-8.
    check_length(name, static_cast<size_t>(std::count_if(value.begin(), value.end(), begins_character)),
                 limit);
  }
  void exact_text(const char* name, std::string& value, size_t limit_bytes) {
    value = get_string(name);
    check_printable(name, value);
    check_length(name, value.size(), limit_bytes);
  }
  void secret(const char* name, std::string& value, size_t limit_bytes) {
    value = get_string(name);
    check_length(name, value.size(), limit_bytes);
  }
  void vector(const char* name, glm::vec3& value, const Range& range) {
    parts(name, value, range, kVectorParts);
  }
  void color(const char* name, glm::vec3& value, const Range& range) {
    parts(name, value, range, kColorParts);
  }
  template <class Body>
  void group(const char* name, Body body) {
    descend(name, PlaceToRead(at_.reflection->GetMessage(*at_.message, &field_of(name))), body);
  }
  template <class T, class Body>
  void repeated(const char* name, std::vector<T>& values, size_t limit, Body body) {
    const auto& field = field_of(name);
    const auto size = static_cast<size_t>(at_.reflection->FieldSize(*at_.message, &field));
    check_length(name, size, limit);
    if (error_) return;  // before anything is allocated
    values.resize(size);
    std::optional<PlaceToRead> place;
    for (size_t i = 0; i < size; ++i) {
      const auto& element = at_.reflection->GetRepeatedMessage(*at_.message, &field, static_cast<int>(i));
      if (place)
        place->message = &element;  // all of one type
      else
        place.emplace(element);
      descend(name, *place, [&] { body(values[i]); });
    }
  }
  void places(const char* name, std::vector<glm::vec3>& values, size_t limit) {
    read_places(name, values, limit, [this](const pb::FieldDescriptor& field, int i) {
      return at_.reflection->GetRepeatedFloat(*at_.message, &field, i);
    });
  }
  void places(const char* name, std::vector<glm::dvec3>& values, size_t limit) {
    read_places(name, values, limit, [this](const pb::FieldDescriptor& field, int i) {
      return at_.reflection->GetRepeatedDouble(*at_.message, &field, i);
    });
  }
  void timecode(const char* name, std::optional<Timecode>& timecode) {
    if (!at_.reflection->HasField(*at_.message, &field_of(name))) return;
    Timecode& given = timecode.emplace();
    group(name, [&] {
      value("rate_numerator", given.rate.numerator);
      value("rate_denominator", given.rate.denominator);
      value("is_drop", given.is_drop);
      value("frame", given.frame);
      value("part", given.part);
    });
    if (!is_timecode_rate(given.rate, given.is_drop) ||
        given.frame >= frames_per_day(given.rate, given.is_drop) || !(given.part >= 0.0 && given.part < 1.0))
      fail(name, make_error(ErrorCode::BadInput, "is no frame of a day of {}/{} frames per second",
                            given.rate.numerator, given.rate.denominator));
  }
  template <class Variant>
  void one_of(const char* name, Variant& whole) {
    const auto* field =
        at_.reflection->GetOneofFieldDescriptor(*at_.message, at_.type->FindOneofByName(name));
    if (field == nullptr || !read_kind(field->name(), *this, whole))
      fail(name, make_error(ErrorCode::BadInput, "is of no known kind"));
  }
  void names(const char* name, std::vector<std::string>& values, size_t limit, size_t limit_bytes) {
    const auto& field = field_of(name);
    const auto size = static_cast<size_t>(at_.reflection->FieldSize(*at_.message, &field));
    check_length(name, size, limit);
    for (size_t i = 0; i < size && !error_; ++i) {
      values.push_back(at_.reflection->GetRepeatedString(*at_.message, &field, static_cast<int>(i)));
      check_printable(name, values.back());
      check_length(name, values.back().size(), limit_bytes);
      if (values.back().empty()) fail(name, make_error(ErrorCode::BadInput, "has an empty name"));
      if (std::count(values.begin(), values.end(), values.back()) > 1)
        fail(name, make_error(ErrorCode::BadInput, "has a name twice"));
    }
  }
  void require(const char* name, bool holds, const char* sentence) {
    if (!holds) fail(name, make_error(ErrorCode::BadInput, "{}", sentence));
  }

 private:
  template <class Point, class Get>
  void read_places(const char* name, std::vector<Point>& values, size_t limit, Get get) {
    const auto& field = field_of(name);
    const auto size = static_cast<size_t>(at_.reflection->FieldSize(*at_.message, &field));
    check_length(name, size, 3 * limit);
    if (size % 3 != 0)
      fail(name, make_error(ErrorCode::BadInput, "has {} numbers, which are not three for each joint", size));
    if (error_) return;  // before anything is allocated
    values.resize(size / 3);
    for (size_t i = 0; i < size; ++i)
      values[i / 3][static_cast<int>(i % 3)] = get(field, static_cast<int>(i));
  }

  /// A missing field of a look or camera keeps its default; any other missing field becomes 0.
  bool is_given(const FoundField& field) const {
    return !field.may_be_missing || at_.reflection->HasField(*at_.message, field.descriptor);
  }

  /// Value in its wire type; the range of T is checked before it is narrowed.
  template <class T>
  auto get(const pb::FieldDescriptor& field) const {
    if constexpr (std::is_same_v<T, bool>)
      return at_.reflection->GetBool(*at_.message, &field);
    else if constexpr (std::is_same_v<T, int64_t>)
      return at_.reflection->GetInt64(*at_.message, &field);
    else if constexpr (std::is_same_v<T, uint64_t>)
      return at_.reflection->GetUInt64(*at_.message, &field);
    else if constexpr (std::is_integral_v<T>)
      return at_.reflection->GetUInt32(*at_.message, &field);
    else
      return field.cpp_type() == pb::FieldDescriptor::CPPTYPE_FLOAT
                 ? static_cast<T>(at_.reflection->GetFloat(*at_.message, &field))
                 : static_cast<T>(at_.reflection->GetDouble(*at_.message, &field));
  }
  const pb::FieldDescriptor& field_of(const char* name) { return *find_field(at_.type, name).descriptor; }
  std::string get_string(const char* name) {
    return at_.reflection->GetString(*at_.message, &field_of(name));
  }

  static bool begins_character(char byte) { return (static_cast<unsigned char>(byte) & 0xc0) != 0x80; }

  void check(const char* name, double number, const Range& range) {
    // Ranges are doubles; a float at the end of one may lie a rounding outside.
    constexpr double kSlack = 1e-6;
    const double low = range.minimum - kSlack * std::abs(range.minimum);
    const double high = range.maximum + kSlack * std::abs(range.maximum);
    if (number >= low && number <= high) return;
    fail(name, make_error(ErrorCode::BadInput, "is {}, it must be within {:g} .. {:g}{}{}", number,
                          range.minimum, range.maximum, *range.unit ? " " : "", range.unit));
  }
  void check_printable(const char* name, const std::string& text) {
    for (const char character : text) {
      const auto byte = static_cast<unsigned char>(character);
      if (byte < 0x20 || byte == 0x7f)
        return fail(name, make_error(ErrorCode::BadInput, "holds the unprintable character 0x{:02x}", byte));
    }
  }
  void check_length(const char* name, size_t length, size_t limit) {
    if (length > limit)
      fail(name, make_error(ErrorCode::LimitExceeded, "has length {}, the limit is {}", length, limit));
  }

  void parts(const char* name, glm::vec3& whole, const Range& range, const PartNames& names) {
    const auto& field = field_of(name);
    const PlaceToRead inner(at_.reflection->GetMessage(*at_.message, &field));
    for (int i = 0; i < 3; ++i) {
      const auto* part = find_field(inner.type, names[static_cast<size_t>(i)]).descriptor;
      if (inner.reflection->HasField(*inner.message, part))
        whole[i] = static_cast<float>(inner.reflection->GetDouble(*inner.message, part));
      check(name, whole[i], range);
    }
  }
  template <class Body>
  void descend(const char* name, const PlaceToRead& inner, Body body) {
    const PlaceToRead outer = std::exchange(at_, inner);
    const char* const outer_group = std::exchange(group_, name);
    body();
    at_ = outer;
    group_ = outer_group;
  }

  void fail(const char* name, Error error) {
    if (error_) return;
    // "command" rather than "command.command".
    const bool has_group = group_ != nullptr && std::strcmp(group_, name) != 0;
    error_ = at(has_group ? fmt::format("{}.{}", group_, name) : name, std::move(error));
  }

  PlaceToRead at_;
  const char* group_ = nullptr;  // that the message is
  std::optional<Error> error_;
};

/// Reads the field `name` into the variant alternative of that kind, searching from index i on. Returns false
/// if there is none.
template <size_t i = 0, class Variant>
bool read_kind(const std::string& name, MessageReader& reader, Variant& result) {
  if constexpr (i == std::variant_size_v<Variant>) {
    return false;
  } else {
    constexpr const char* kName = kKind<std::variant_alternative_t<i, Variant>>;
    if (name != kName) return read_kind<i + 1>(name, reader, result);
    reader.group(kName, [&] { wire_fields::visit(reader, result.template emplace<i>()); });
    return true;
  }
}

}  // namespace strandcast
