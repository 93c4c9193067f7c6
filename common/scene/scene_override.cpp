#include "common/scene/scene_override.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>

#include <charconv>
#include <optional>

#include "common/base/frame_rate.h"
#include "common/base/text.h"
#include "common/groom/groom.h"
#include "common/scene/scene_desc.h"

namespace strandcast {
namespace {

namespace pb = google::protobuf;

constexpr size_t kMaxOverrideChars = 200,
                 kMaxValueChars = 40;  // of an assignment and its parts, in error messages

/// Keeps the first message of the parser instead of printing it.
class FirstError : public pb::io::ErrorCollector {
 public:
  void AddError(int, int, const std::string& message) override {
    if (text_.empty()) text_ = message;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

/// Where an assignment stands while its path is walked.
struct Cursor {
  pb::Message* message = nullptr;
  std::string walked;  // for error messages

  const pb::Descriptor& type() const { return *message->GetDescriptor(); }
  std::string name() const { return walked.empty() ? "a scene" : walked; }
  void step(std::string_view part) {
    if (!walked.empty()) walked += '.';
    walked += part;
  }
};

std::string known_values(const pb::EnumDescriptor& type) {
  std::string list = "known: ";
  for (int i = 0; i < type.value_count(); ++i)
    list += fmt::format("{}{}", i ? ", " : "", type.value(i)->name());
  return list;
}

/// The exact rate that a quotient, or a rounded rate of television, means; other numbers stay as they are.
Result<std::string> as_number(const pb::FieldDescriptor& field, const std::string& value) {
  constexpr double kMostSceneRateHz = 1e4;
  constexpr uint32_t kTelevision = 1001;
  if (!field.name().ends_with("_hz")) return value;
  const bool is_quotient = value.find('/') != std::string::npos;
  const auto rate = parse_frame_rate(value, kLeastFrameRate, kMostSceneRateHz);
  if (is_quotient && !rate) return rate.error();
  const bool is_exact = rate && (is_quotient || rate->denominator == kTelevision);
  return is_exact ? fmt::format("{}", rate->hz()) : value;
}

Status set_value(Cursor& cursor, const pb::FieldDescriptor& field, const std::string& value) {
  if (field.cpp_type() == pb::FieldDescriptor::CPPTYPE_STRING) {
    cursor.message->GetReflection()->SetString(cursor.message, &field, value);
    return {};
  }
  if (field.cpp_type() == pb::FieldDescriptor::CPPTYPE_ENUM && !field.enum_type()->FindValueByName(value))
    return make_error(ErrorCode::BadInput, "\"{}\" is not a value of {} ({})", excerpt(value, kMaxValueChars),
                      field.name(), known_values(*field.enum_type()));
  if (field.cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE && !value.starts_with('{'))
    return make_error(ErrorCode::BadInput, "{} is a group of fields, name one of them ({})", field.name(),
                      known_fields(*field.message_type()));
  ASSIGN_OR_RETURN(const std::string number, as_number(field, value));
  FirstError error;
  pb::TextFormat::Parser parser;
  parser.RecordErrorsTo(&error);
  if (parser.ParseFieldValueFromString(number, &field, cursor.message)) return {};
  return make_error(ErrorCode::BadInput, "\"{}\" is not a value for {}{}{}", excerpt(value, kMaxValueChars),
                    field.name(), error.text().empty() ? "" : ": ", error.text());
}

std::optional<int> parse_index(std::string_view text) {
  int index = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), index);
  if (failure != std::errc{} || end != text.data() + text.size() || index < 0) return std::nullopt;
  return index;
}

/// Steps into element `part` of a list; the element after the last one is added.
Status step_into_list(Cursor& cursor, const pb::FieldDescriptor& field, std::string_view part) {
  const auto* reflection = cursor.message->GetReflection();
  const int size = reflection->FieldSize(*cursor.message, &field);
  const int last = std::min<int>(size, kMaxSphereColliders - 1);
  const auto index = parse_index(part);
  if (!index || *index > last)
    return make_error(ErrorCode::BadInput, "\"{}\" is not an index of {} (0 .. {})",
                      excerpt(part, kMaxValueChars), cursor.walked, last);
  cursor.step(part);
  cursor.message = *index < size ? reflection->MutableRepeatedMessage(cursor.message, &field, *index)
                                 : reflection->AddMessage(cursor.message, &field);
  return {};
}

/// Sets the entry `key` of a map from text to number.
Status set_map_entry(Cursor& cursor, const pb::FieldDescriptor& field, std::string_view key,
                     const std::string& value) {
  const auto* reflection = cursor.message->GetReflection();
  const auto& key_field = *field.message_type()->map_key();
  pb::Message* entry = nullptr;
  for (int i = 0; i < reflection->FieldSize(*cursor.message, &field) && !entry; ++i) {
    auto* candidate = reflection->MutableRepeatedMessage(cursor.message, &field, i);
    if (candidate->GetReflection()->GetString(*candidate, &key_field) == key) entry = candidate;
  }
  if (!entry) entry = reflection->AddMessage(cursor.message, &field);
  entry->GetReflection()->SetString(entry, &key_field, std::string(key));
  Cursor inside{entry, cursor.walked};
  return set_value(inside, *field.message_type()->map_value(), value);
}

/// Sets element `part` of a list of texts; the element after the last one is added.
Status set_text_of_list(Cursor& cursor, const pb::FieldDescriptor& field, std::string_view part,
                        const std::string& value) {
  const auto* reflection = cursor.message->GetReflection();
  const int size = reflection->FieldSize(*cursor.message, &field);
  const auto index = parse_index(part);
  if (!index || *index > size)
    return make_error(ErrorCode::BadInput, "\"{}\" is not an index of {} (0 .. {})",
                      excerpt(part, kMaxValueChars), cursor.walked, size);
  if (*index == size) {
    reflection->AddString(cursor.message, &field, value);
  } else {
    reflection->SetRepeatedString(cursor.message, &field, *index, value);
  }
  return {};
}

Status assign(Cursor cursor, std::string_view path, const std::string& value) {
  for (;;) {
    const size_t dot = path.find('.');
    const std::string part(path.substr(0, dot));
    const std::string_view rest = dot == std::string_view::npos ? std::string_view{} : path.substr(dot + 1);
    const auto* field = cursor.type().FindFieldByName(part);
    if (!field)
      return make_error(ErrorCode::BadInput, "{} has no field \"{}\" ({})", cursor.name(),
                        excerpt(part, kMaxValueChars), known_fields(cursor.type()));
    cursor.step(part);
    if (field->is_map() && !rest.empty()) return set_map_entry(cursor, *field, rest, value);
    if (field->is_repeated() && field->cpp_type() == pb::FieldDescriptor::CPPTYPE_STRING)
      return set_text_of_list(cursor, *field, rest, value);
    if (field->is_repeated()) {
      const size_t end = rest.find('.');
      if (rest.empty() || end == std::string_view::npos)
        return make_error(
            ErrorCode::BadInput, "{} is a list, name one value in it, for example {}.{}", cursor.walked,
            cursor.walked,
            field->is_map() ? "KEY" : fmt::format("0.{}", field->message_type()->field(0)->name()));
      RETURN_IF_ERROR(step_into_list(cursor, *field, rest.substr(0, end)));
      path = rest.substr(end + 1);
      continue;
    }
    if (rest.empty()) return set_value(cursor, *field, value);
    if (field->cpp_type() != pb::FieldDescriptor::CPPTYPE_MESSAGE)
      return make_error(ErrorCode::BadInput, "{} is a single value and has no field \"{}\"", cursor.walked,
                        excerpt(rest, kMaxValueChars));
    cursor.message = cursor.message->GetReflection()->MutableMessage(cursor.message, field);
    path = rest;
  }
}

}  // namespace

std::string known_fields(const pb::Descriptor& descriptor) {
  std::string list = "known: ";
  for (int i = 0; i < descriptor.field_count(); ++i)
    list += fmt::format("{}{}", i ? ", " : "", descriptor.field(i)->name());
  return list;
}

std::string_view override_path(std::string_view assignment) {
  return assignment.substr(0, assignment.find('='));
}

Status apply_override(pb::Message& scene, const std::string& assignment) {
  const std::string place = fmt::format("--set {}", excerpt(assignment, kMaxOverrideChars));
  if (assignment.size() > kMaxOverrideBytes)
    return at(place, make_error(ErrorCode::LimitExceeded, "the override has {} bytes, the limit is {}",
                                assignment.size(), kMaxOverrideBytes));
  const std::string path(override_path(assignment));
  if (path.size() == assignment.size() || path.empty())
    return at(place,
              make_error(ErrorCode::BadInput, "expected path=value, for example stream.bound_m=0.0002"));
  if (auto status = assign({&scene, {}}, path, assignment.substr(path.size() + 1)); !status)
    return at(place, status.error());
  return {};
}

}  // namespace strandcast
