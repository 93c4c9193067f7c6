#include "common/groom/usdc_archive.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <glm/gtc/packing.hpp>
#include <utility>

namespace strandcast {
namespace {

constexpr uint8_t kFirstMinor = 4;  // sections are packed since then
constexpr uint8_t kMinorWithoutRank = 5, kMinorOfLongCounts = 7;
constexpr uint64_t kMostSections = 64;
constexpr size_t kUncodedPaths = 16;  // the empty one has a number and no place
constexpr size_t kSectionBytes = 32;
constexpr uint32_t kNowhere = ~0u;

Error wrong_type(UsdcValue value, std::string_view wanted) {
  return make_error(ErrorCode::BadInput, "a value of type {}{} where {} belong",
                    static_cast<int>(value.type()), value.is(UsdcValue::kArray) ? "[]" : "", wanted);
}

/// How many numbers a value has, and of which type each of them is.
std::pair<size_t, UsdcType> numbers_of(UsdcType type) {
  switch (type) {
    case UsdcType::Half:
    case UsdcType::Float:
    case UsdcType::Double:
    case UsdcType::Int:
      return {1, type};
    case UsdcType::Vec2h:
      return {2, UsdcType::Half};
    case UsdcType::Vec2f:
      return {2, UsdcType::Float};
    case UsdcType::Vec2d:
      return {2, UsdcType::Double};
    case UsdcType::Vec3h:
      return {3, UsdcType::Half};
    case UsdcType::Vec3f:
      return {3, UsdcType::Float};
    case UsdcType::Vec3d:
      return {3, UsdcType::Double};
    case UsdcType::Quath:
      return {4, UsdcType::Half};
    case UsdcType::Quatf:
      return {4, UsdcType::Float};
    case UsdcType::Quatd:
      return {4, UsdcType::Double};
    case UsdcType::Matrix4d:
      return {16, UsdcType::Double};
    default:
      return {0, type};
  }
}

/// Numbers that are kept in the place of an offset: small ones, of a matrix its diagonal.
std::vector<double> inlined_numbers(UsdcValue value, size_t count) {
  const auto bits = static_cast<uint32_t>(value.payload());
  if (count == 1) {
    if (value.type() == UsdcType::Int) return {static_cast<double>(static_cast<int32_t>(bits))};
    if (value.type() == UsdcType::Half)
      return {static_cast<double>(glm::unpackHalf1x16(static_cast<uint16_t>(bits)))};
    return {static_cast<double>(std::bit_cast<float>(bits))};
  }
  std::vector<double> numbers(count, 0.0);
  const size_t step = count == 16 ? 5 : 1;
  for (size_t i = 0; i * step < count; ++i)
    numbers[i * step] = static_cast<double>(static_cast<int8_t>(bits >> (8 * i)));
  return numbers;
}

}  // namespace

/// Reads one thing after another, up to an end.
class UsdcArchive::Cursor {
 public:
  Cursor(GroomSource& source, uint64_t offset, uint64_t end) : source_(source), at_(offset), end_(end) {}

  template <class T>
  Result<T> number() {
    RETURN_IF_ERROR(check(sizeof(T)));
    at_ += sizeof(T);
    return source_.number<T>(at_ - sizeof(T));
  }
  /// Reads how many items follow.
  Result<size_t> count(const char* what) {
    ASSIGN_OR_RETURN(const auto count, number<uint64_t>());
    if (count > kMaxUsdcItems)
      return make_error(ErrorCode::LimitExceeded, "{} {}, at most {} are allowed", count, what,
                        kMaxUsdcItems);
    return static_cast<size_t>(count);
  }
  Result<std::vector<std::byte>> bytes(uint64_t size_bytes) {
    RETURN_IF_ERROR(check(size_bytes));
    at_ += size_bytes;
    return source_.array<std::byte>(at_ - size_bytes, size_bytes);
  }
  /// Reads packed bytes behind their number, and unpacks them.
  Result<std::vector<std::byte>> packed_bytes(size_t limit_bytes) {
    ASSIGN_OR_RETURN(const auto size_bytes, number<uint64_t>());
    ASSIGN_OR_RETURN(const auto packed, bytes(size_bytes));
    RETURN_IF_ERROR(source_.claim(limit_bytes));
    return unpack_usdc_bytes(packed, limit_bytes);
  }
  Result<std::vector<int32_t>> packed_ints(size_t count) {
    ASSIGN_OR_RETURN(const auto size_bytes, number<uint64_t>());
    ASSIGN_OR_RETURN(const auto packed, bytes(size_bytes));
    RETURN_IF_ERROR(source_.claim(count * sizeof(int32_t)));
    return unpack_usdc_ints(packed, count);
  }
  uint64_t at() const { return at_; }

 private:
  Status check(uint64_t size_bytes) const {
    if (at_ <= end_ && size_bytes <= end_ - at_) return {};
    return make_error(ErrorCode::BadInput,
                      "{} bytes are needed at byte {}, which lead past byte {}: it is cut "
                      "off or damaged",
                      size_bytes, at_, end_);
  }

  GroomSource& source_;
  uint64_t at_;
  uint64_t end_;
};

Result<UsdcArchive> UsdcArchive::read(std::shared_ptr<GroomSource> source) {
  UsdcArchive archive(std::move(source));
  RETURN_IF_ERROR(archive.read_header());
  RETURN_IF_ERROR(archive.read_tokens());
  RETURN_IF_ERROR(archive.read_fields());
  RETURN_IF_ERROR(archive.read_paths());
  RETURN_IF_ERROR(archive.read_specs());
  return archive;
}

Status UsdcArchive::read_header() {
  if (source_->size_bytes() < kUsdcHeaderBytes)
    return make_error(ErrorCode::BadInput, "{} bytes, the header of binary USD alone has {}",
                      source_->size_bytes(), kUsdcHeaderBytes);
  ASSIGN_OR_RETURN(const std::vector<char> header, source_->array<char>(0, kUsdcHeaderBytes));
  if (!std::string_view(header.data(), header.size()).starts_with(kUsdcMagic))
    return make_error(ErrorCode::BadInput, "does not begin with '{}': not binary USD", kUsdcMagic);
  const auto major = static_cast<uint8_t>(header[kUsdcVersionAt]);
  minor_version_ = static_cast<uint8_t>(header[kUsdcVersionAt + 1]);
  if (major != 0 || minor_version_ < kFirstMinor)
    return make_error(ErrorCode::Unsupported, "binary USD of version {}.{}, known is 0.{} and later", major,
                      minor_version_, kFirstMinor);
  uint64_t contents = 0;
  std::memcpy(&contents, header.data() + kUsdcContentsAt, sizeof(contents));
  if (contents == 0) return make_error(ErrorCode::BadInput, "its writer did not finish it: export it anew");
  RETURN_IF_ERROR(source_->check_reaches(contents));
  Cursor cursor(*source_, contents, source_->size_bytes());
  ASSIGN_OR_RETURN(const auto count, cursor.number<uint64_t>());
  if (count > kMostSections)
    return make_error(ErrorCode::BadInput, "{} sections, at most {} are known", count, kMostSections);
  for (uint64_t i = 0; i < count; ++i) {
    ASSIGN_OR_RETURN(const auto entry, cursor.bytes(kSectionBytes));
    const auto* const text = reinterpret_cast<const char*>(entry.data());
    Section section{std::string(text, strnlen(text, kUsdcSectionNameBytes)), {}};
    std::memcpy(&section.bytes, entry.data() + kUsdcSectionNameBytes, sizeof(section.bytes));
    sections_.push_back(std::move(section));
  }
  return {};
}

Result<UsdcArchive::Cursor> UsdcArchive::section(std::string_view name) const {
  for (const Section& known : sections_) {
    if (known.name != name) continue;
    if (!source_->has(known.bytes.offset, known.bytes.count, 1))
      return make_error(ErrorCode::BadInput,
                        "{} should be {} bytes at byte {} of {}: it is cut off or damaged", name,
                        known.bytes.count, known.bytes.offset, source_->size_bytes());
    return Cursor(*source_, known.bytes.offset, known.bytes.offset + known.bytes.count);
  }
  return make_error(ErrorCode::BadInput, "it has no section {}", name);
}

Status UsdcArchive::read_tokens() {
  ASSIGN_OR_RETURN(Cursor cursor, section("TOKENS"));
  ASSIGN_OR_RETURN(const size_t count, cursor.count("tokens"));
  ASSIGN_OR_RETURN(const auto text_bytes, cursor.number<uint64_t>());
  if (text_bytes > kMaxUsdcTokenBytes)
    return make_error(ErrorCode::LimitExceeded, "tokens of {} bytes, at most {} are allowed", text_bytes,
                      kMaxUsdcTokenBytes);
  ASSIGN_OR_RETURN(token_text_, cursor.packed_bytes(text_bytes));
  const std::string_view text(reinterpret_cast<const char*>(token_text_.data()), token_text_.size());
  for (size_t begin = 0; begin < text.size() && tokens_.size() < count;) {
    const size_t end = std::min(text.find('\0', begin), text.size());
    tokens_.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  if (tokens_.size() != count)
    return make_error(ErrorCode::BadInput, "it should have {} tokens, {} are there", count, tokens_.size());
  ASSIGN_OR_RETURN(Cursor strings, section("STRINGS"));
  ASSIGN_OR_RETURN(const size_t string_count, strings.count("strings"));
  ASSIGN_OR_RETURN(strings_, source_->array<uint32_t>(strings.at(), string_count));
  return {};
}

Status UsdcArchive::read_fields() {
  ASSIGN_OR_RETURN(Cursor cursor, section("FIELDS"));
  ASSIGN_OR_RETURN(const size_t count, cursor.count("fields"));
  ASSIGN_OR_RETURN(field_names_, cursor.packed_ints(count));
  for (const int32_t name : field_names_) RETURN_IF_ERROR(check_token(name));
  ASSIGN_OR_RETURN(const auto values, cursor.packed_bytes(count * sizeof(UsdcValue)));
  if (values.size() != count * sizeof(UsdcValue))
    return make_error(ErrorCode::BadInput, "{} bytes of values of {} fields", values.size(), count);
  field_values_.resize(count);
  if (count > 0) std::memcpy(field_values_.data(), values.data(), values.size());
  ASSIGN_OR_RETURN(Cursor sets, section("FIELDSETS"));
  ASSIGN_OR_RETURN(const size_t set_count, sets.count("field sets"));
  ASSIGN_OR_RETURN(field_sets_, sets.packed_ints(set_count));
  return {};
}

Status UsdcArchive::read_paths() {
  ASSIGN_OR_RETURN(Cursor cursor, section("PATHS"));
  ASSIGN_OR_RETURN(const size_t count, cursor.count("paths"));
  ASSIGN_OR_RETURN(const size_t coded_count, cursor.count("coded paths"));
  std::array<std::vector<int32_t>, 3> coded;
  for (std::vector<int32_t>& ints : coded) {
    ASSIGN_OR_RETURN(ints, cursor.packed_ints(coded_count));
  }
  if (count > coded_count + kUncodedPaths)
    return make_error(ErrorCode::BadInput, "{} paths, of which {} are stated", count, coded_count);
  paths_.assign(count, {kNowhere, 0});
  return place_paths(coded);
}

/// Each path is followed by what is in it, then by its next sibling, which a jump leads to.
Status UsdcArchive::place_paths(const std::array<std::vector<int32_t>, 3>& coded) {
  const auto& [path, element, jump] = coded;
  const size_t count = path.size();
  struct Next {
    size_t at;
    uint32_t parent;
  };
  std::vector<Next> open;
  if (count > 0) open.push_back({0, kNowhere});
  size_t placed = 0;
  while (!open.empty()) {
    auto [i, parent] = open.back();
    open.pop_back();
    const auto own = static_cast<uint32_t>(path[i]);
    if (own >= paths_.size())
      return make_error(ErrorCode::BadInput, "path number {} of {}", own, paths_.size());
    if (++placed > count) return make_error(ErrorCode::BadInput, "paths that lead in circles");
    if (parent == kNowhere) {
      parent = own;  // the root
    } else {
      const int64_t token = element[i] < 0 ? -int64_t{element[i]} : int64_t{element[i]};
      RETURN_IF_ERROR(check_token(token));
      paths_[own] = {parent, static_cast<int32_t>(token)};
    }
    const bool has_child = jump[i] > 0 || jump[i] == -1, has_sibling = jump[i] >= 0;
    const size_t sibling = i + (has_child && has_sibling ? static_cast<size_t>(jump[i]) : 1);
    if ((has_child && i + 1 >= count) || (has_sibling && sibling >= count))
      return make_error(ErrorCode::BadInput, "path {} leads past the last one, {}", i, count);
    if (has_sibling) open.push_back({sibling, parent});
    if (has_child) open.push_back({i + 1, own});
  }
  return {};
}

Status UsdcArchive::read_specs() {
  ASSIGN_OR_RETURN(Cursor cursor, section("SPECS"));
  ASSIGN_OR_RETURN(const size_t count, cursor.count("specs"));
  std::array<std::vector<int32_t>, 3> coded;
  for (std::vector<int32_t>& ints : coded) {
    ASSIGN_OR_RETURN(ints, cursor.packed_ints(count));
  }
  root_ = kNowhere;
  for (size_t i = 0; i < count; ++i) {
    const UsdcSpec spec{static_cast<uint32_t>(coded[0][i]), static_cast<uint32_t>(coded[1][i]),
                        static_cast<UsdcKind>(coded[2][i])};
    if (spec.path >= paths_.size() || spec.fields >= field_sets_.size())
      return make_error(ErrorCode::BadInput, "spec {} has path {} of {} and field set {} of {}", i, spec.path,
                        paths_.size(), spec.fields, field_sets_.size());
    if (spec.kind == UsdcKind::Root) root_ = static_cast<uint32_t>(i);
    specs_.push_back(spec);
  }
  if (root_ == kNowhere) return make_error(ErrorCode::BadInput, "it has no root");
  return {};
}

Status UsdcArchive::check_token(int64_t index) const {
  if (index >= 0 && index < static_cast<int64_t>(tokens_.size())) return {};
  return make_error(ErrorCode::BadInput, "token {} of {}", index, tokens_.size());
}

Result<std::optional<UsdcValue>> UsdcArchive::field(const UsdcSpec& spec, std::string_view name) const {
  for (size_t i = spec.fields; i < field_sets_.size(); ++i) {
    const auto index = static_cast<uint32_t>(field_sets_[i]);
    if (index == kNowhere) return std::optional<UsdcValue>();
    if (index >= field_values_.size())
      return make_error(ErrorCode::BadInput, "field {} of {}", index, field_values_.size());
    if (i - spec.fields >= kMaxUsdcFields)
      return make_error(ErrorCode::LimitExceeded, "more than {} fields of one spec", kMaxUsdcFields);
    if (token(field_names_[index]) == name) return std::optional(field_values_[index]);
  }
  return make_error(ErrorCode::BadInput, "field set {} has no end", spec.fields);
}

Result<std::string_view> UsdcArchive::text(UsdcValue value) const {
  uint64_t index = value.payload();
  const bool is_string = value.type() == UsdcType::String;
  if (!value.is(UsdcValue::kInlined) || value.is(UsdcValue::kArray) ||
      (value.type() != UsdcType::Token && !is_string))
    return wrong_type(value, "tokens");
  if (is_string && index >= strings_.size())
    return make_error(ErrorCode::BadInput, "string {} of {}", index, strings_.size());
  if (is_string) index = strings_[index];
  RETURN_IF_ERROR(check_token(static_cast<int64_t>(index)));
  return tokens_[index];
}

Result<UsdcArchive::Span> UsdcArchive::array_span(UsdcValue value, size_t limit) const {
  Span span{value.payload(), 0};
  if (value.type() == UsdcType::ValueBlock || span.offset == 0) return span;
  Cursor cursor(*source_, span.offset, source_->size_bytes());
  const bool is_vector = value.type() == UsdcType::TokenVector;
  if (!is_vector && minor_version_ < kMinorWithoutRank) {
    ASSIGN_OR_RETURN([[maybe_unused]] const auto rank, cursor.number<uint32_t>());
  }
  if (is_vector || minor_version_ >= kMinorOfLongCounts) {
    ASSIGN_OR_RETURN(span.count, cursor.number<uint64_t>());
  } else {
    ASSIGN_OR_RETURN(span.count, cursor.number<uint32_t>());
  }
  if (span.count > limit)
    return make_error(ErrorCode::LimitExceeded, "an array of {} values, at most {} are allowed", span.count,
                      limit);
  span.offset = cursor.at();
  return span;
}

Result<std::vector<int32_t>> UsdcArchive::texts(UsdcValue value, size_t limit) const {
  const bool is_list =
      value.type() == UsdcType::TokenVector ||
      ((value.type() == UsdcType::Token || value.type() == UsdcType::String) && value.is(UsdcValue::kArray));
  if (!is_list && value.type() != UsdcType::ValueBlock) return wrong_type(value, "lists of tokens");
  ASSIGN_OR_RETURN(const Span span, array_span(value, limit));
  ASSIGN_OR_RETURN(auto indices, source_->array<int32_t>(span.offset, span.count));
  for (int32_t& index : indices) {
    if (value.type() == UsdcType::String) {
      if (index < 0 || static_cast<size_t>(index) >= strings_.size())
        return make_error(ErrorCode::BadInput, "string {} of {}", index, strings_.size());
      index = static_cast<int32_t>(strings_[static_cast<size_t>(index)]);
    }
    RETURN_IF_ERROR(check_token(index));
  }
  return indices;
}

Result<std::vector<double>> UsdcArchive::numbers(UsdcValue value) const {
  if (value.type() == UsdcType::ValueBlock) return std::vector<double>();
  const auto [count, type] = numbers_of(value.type());
  const bool is_inlined = value.is(UsdcValue::kInlined);
  if (count == 0 || value.is(UsdcValue::kArray) || (is_inlined ? count == 4 : type == UsdcType::Int))
    return wrong_type(value, "numbers");
  if (is_inlined) return inlined_numbers(value, count);
  std::vector<double> numbers;
  if (type == UsdcType::Double) {
    ASSIGN_OR_RETURN(numbers, source_->array<double>(value.payload(), count));
  } else {
    ASSIGN_OR_RETURN(const auto narrow, stored_floats({value.payload(), count}, type));
    numbers.assign(narrow.begin(), narrow.end());
  }
  if (count == 4) std::rotate(numbers.begin(), numbers.begin() + 3, numbers.end());  // the real part is last
  return numbers;
}

Result<std::vector<float>> UsdcArchive::stored_floats(const Span& span, UsdcType type) const {
  if (type == UsdcType::Float) return source_->array<float>(span.offset, span.count);
  std::vector<float> floats;
  if (type == UsdcType::Double) {
    ASSIGN_OR_RETURN(const auto wide, source_->array<double>(span.offset, span.count));
    floats.reserve(wide.size());
    for (const double number : wide) floats.push_back(static_cast<float>(number));
  } else {
    ASSIGN_OR_RETURN(const auto halves, source_->array<uint16_t>(span.offset, span.count));
    for (const uint16_t half : halves) floats.push_back(glm::unpackHalf1x16(half));
  }
  return floats;
}

Result<std::vector<float>> UsdcArchive::packed_floats(const Span& span, UsdcType type) const {
  Cursor cursor(*source_, span.offset, source_->size_bytes());
  ASSIGN_OR_RETURN(const char code, cursor.number<char>());
  if (code == 'i') {
    ASSIGN_OR_RETURN(const auto ints, cursor.packed_ints(span.count));
    return std::vector<float>(ints.begin(), ints.end());
  }
  if (code != 't') return make_error(ErrorCode::BadInput, "numbers packed in way {}", static_cast<int>(code));
  ASSIGN_OR_RETURN(const auto table_size, cursor.number<uint32_t>());
  const size_t item_bytes = type == UsdcType::Double ? 8 : type == UsdcType::Float ? 4 : 2;
  if (table_size > span.count)
    return make_error(ErrorCode::BadInput, "a table of {} for {} numbers", table_size, span.count);
  ASSIGN_OR_RETURN(const auto table, stored_floats({cursor.at(), table_size}, type));
  Cursor rest(*source_, cursor.at() + item_bytes * table_size, source_->size_bytes());
  ASSIGN_OR_RETURN(const auto indices, rest.packed_ints(span.count));
  std::vector<float> floats;
  floats.reserve(indices.size());
  for (const int32_t index : indices) {
    if (static_cast<uint32_t>(index) >= table.size())
      return make_error(ErrorCode::BadInput, "number {} of a table of {}", index, table.size());
    floats.push_back(table[static_cast<uint32_t>(index)]);
  }
  return floats;
}

Result<std::vector<float>> UsdcArchive::floats(UsdcValue value, size_t limit) const {
  const auto [count, type] = numbers_of(value.type());
  const bool is_list = value.is(UsdcValue::kArray) && count == 1 && type != UsdcType::Int;
  if (!is_list && value.type() != UsdcType::ValueBlock) return wrong_type(value, "lists of numbers");
  ASSIGN_OR_RETURN(const Span span, array_span(value, limit));
  const bool is_packed = value.is(UsdcValue::kPacked) && span.count >= kLeastUsdcPacked;
  return is_packed ? packed_floats(span, type) : stored_floats(span, type);
}

Result<std::vector<int32_t>> UsdcArchive::ints(UsdcValue value, size_t limit) const {
  const bool is_list =
      value.is(UsdcValue::kArray) && (value.type() == UsdcType::Int || value.type() == UsdcType::UInt);
  if (!is_list && value.type() != UsdcType::ValueBlock) return wrong_type(value, "lists of whole numbers");
  ASSIGN_OR_RETURN(const Span span, array_span(value, limit));
  if (!value.is(UsdcValue::kPacked) || span.count < kLeastUsdcPacked)
    return source_->array<int32_t>(span.offset, span.count);
  return Cursor(*source_, span.offset, source_->size_bytes()).packed_ints(span.count);
}

Result<std::vector<double>> UsdcArchive::list(UsdcValue value, size_t limit) const {
  const auto [count, type] = numbers_of(value.type());
  if (!value.is(UsdcValue::kArray)) return std::vector<double>();
  if (value.type() == UsdcType::Int || value.type() == UsdcType::UInt) {
    ASSIGN_OR_RETURN(const auto whole, ints(value, limit));
    return std::vector<double>(whole.begin(), whole.end());
  }
  if (count == 1) {
    ASSIGN_OR_RETURN(const auto single, floats(value, limit));
    return std::vector<double>(single.begin(), single.end());
  }
  if (count != 2) return std::vector<double>();
  ASSIGN_OR_RETURN(const Span span, array_span(value, limit));
  ASSIGN_OR_RETURN(const auto pairs, stored_floats({span.offset, 2 * span.count}, type));
  return std::vector<double>(pairs.begin(), pairs.end());
}

Result<std::vector<glm::vec3>> UsdcArchive::points(UsdcValue value, size_t limit) const {
  const auto [count, type] = numbers_of(value.type());
  const bool is_list = value.is(UsdcValue::kArray) && count == 3;
  if (!is_list && value.type() != UsdcType::ValueBlock) return wrong_type(value, "points");
  ASSIGN_OR_RETURN(const Span span, array_span(value, limit));
  if (type == UsdcType::Float) return source_->array<glm::vec3>(span.offset, span.count);
  ASSIGN_OR_RETURN(const auto floats, stored_floats({span.offset, 3 * span.count}, type));
  std::vector<glm::vec3> points;
  points.reserve(span.count);
  for (size_t i = 0; i < floats.size(); i += 3) points.emplace_back(floats[i], floats[i + 1], floats[i + 2]);
  return points;
}

Result<std::optional<UsdcArchive::Sample>> UsdcArchive::sample(UsdcValue value, uint64_t index) const {
  if (value.type() != UsdcType::TimeSamples) return wrong_type(value, "time samples");
  uint64_t at = value.payload();
  ASSIGN_OR_RETURN(const auto to_times, source_->number<uint64_t>(at));
  at += to_times;
  ASSIGN_OR_RETURN(const auto times_bits, source_->number<uint64_t>(at));
  at += sizeof(times_bits);
  ASSIGN_OR_RETURN(const auto to_values, source_->number<uint64_t>(at));
  at += to_values;
  ASSIGN_OR_RETURN(const auto count, source_->number<uint64_t>(at));
  if (index >= count) return std::optional<Sample>();
  const UsdcValue times{times_bits};
  if (times.type() != UsdcType::DoubleVector) return wrong_type(times, "times");
  const uint64_t behind = (1 + index) * sizeof(uint64_t);
  Sample sample;
  ASSIGN_OR_RETURN(sample.time, source_->number<double>(times.payload() + behind));
  ASSIGN_OR_RETURN(sample.value.bits, source_->number<uint64_t>(at + behind));
  return std::optional(sample);
}

}  // namespace strandcast
