#include "common/groom/ply_table.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/groom/ply_loader.h"
#include "common/groom/text_scan.h"

namespace strandcast {
namespace {

struct TypeName {
  std::string_view name, other_name;
  PlyType type;
  size_t bytes;
};
constexpr std::array<TypeName, 8> kTypes = {{{"char", "int8", PlyType::Int8, 1},
                                             {"uchar", "uint8", PlyType::UInt8, 1},
                                             {"short", "int16", PlyType::Int16, 2},
                                             {"ushort", "uint16", PlyType::UInt16, 2},
                                             {"int", "int32", PlyType::Int32, 4},
                                             {"uint", "uint32", PlyType::UInt32, 4},
                                             {"float", "float32", PlyType::Float32, 4},
                                             {"double", "float64", PlyType::Float64, 8}}};

const TypeName& named(PlyType type) {
  return kTypes[static_cast<size_t>(type)];
}

Result<PlyType> read_type(TextScan& scan) {
  const std::string_view word = scan.next_word();
  for (const TypeName& known : kTypes)
    if (word == known.name || word == known.other_name) return known.type;
  return line_error(scan, ErrorCode::BadInput,
                    "{} is no type, known are char, uchar, short, ushort, int, uint, float and double",
                    quoted(word));
}

Result<PlyProperty> read_property(TextScan& scan) {
  PlyProperty property;
  TextScan ahead = scan;
  if (ahead.next_word() == "list") {
    scan = ahead;
    ASSIGN_OR_RETURN(property.count_type, read_type(scan));
    if (*property.count_type >= PlyType::Float32)
      return line_error(scan, ErrorCode::BadInput, "the length of a list has the type {}, it is no number",
                        named(*property.count_type).name);
  }
  ASSIGN_OR_RETURN(property.type, read_type(scan));
  property.name = scan.next_word();
  if (property.name.empty()) return line_error(scan, ErrorCode::BadInput, "a property without a name");
  return property;
}

Result<PlyElement> read_element(TextScan& scan) {
  PlyElement element;
  element.name = scan.next_word();
  const std::string_view word = scan.next_word();
  const auto count = parse_number<uint64_t>(word);
  if (!count)
    return line_error(scan, ErrorCode::BadInput, "the number of rows is {}, a whole number is needed",
                      quoted(word));
  element.row_count = *count;
  return element;
}

Result<PlyFormat> read_format(TextScan& scan) {
  const std::string_view word = scan.next_word();
  if (word == "ascii") return PlyFormat::Text;
  if (word == "binary_little_endian") return PlyFormat::LittleEndian;
  if (word == "binary_big_endian") return PlyFormat::BigEndian;
  return line_error(scan, ErrorCode::BadInput,
                    "the format is {}, known are ascii, binary_little_endian and binary_big_endian",
                    quoted(word));
}

Status add_line(TextScan& scan, PlyHeader& header, bool& has_format) {
  const std::string_view key = scan.next_word();
  if (key == "format") {
    ASSIGN_OR_RETURN(header.format, read_format(scan));
    has_format = true;
  } else if (key == "element") {
    if (header.element.size() == kMaxPlyElements)
      return line_error(scan, ErrorCode::LimitExceeded, "more than {} elements", kMaxPlyElements);
    ASSIGN_OR_RETURN(PlyElement element, read_element(scan));
    header.element.push_back(std::move(element));
  } else if (key == "property") {
    if (header.element.empty())
      return line_error(scan, ErrorCode::BadInput, "a property stands before the first element");
    if (header.element.back().property.size() == kMaxPlyProperties)
      return line_error(scan, ErrorCode::LimitExceeded, "more than {} properties", kMaxPlyProperties);
    ASSIGN_OR_RETURN(PlyProperty property, read_property(scan));
    header.element.back().property.push_back(std::move(property));
  } else if (key == "comment") {
    std::string words;
    for (std::string_view word = scan.next_word(); !word.empty(); word = scan.next_word()) {
      if (!words.empty()) words += ' ';
      words += word;
    }
    header.comment.push_back(std::move(words));
  } else if (key != "obj_info") {
    return line_error(scan, ErrorCode::BadInput,
                      "{} is no header line, known are format, comment, obj_info, element, property and "
                      "end_header",
                      quoted(key));
  }
  return {};
}

/// Where the line after the one that begins at `from` begins.
size_t after_line(std::string_view text, size_t from) {
  const size_t end = text.find_first_of("\r\n", from);
  if (end == std::string_view::npos) return text.size();
  const bool is_crlf = text[end] == '\r' && end + 1 < text.size() && text[end + 1] == '\n';
  return end + (is_crlf ? 2 : 1);
}

/// The bytes up to and including the line "end_header"; 0 when there is none.
size_t header_bytes(std::string_view file) {
  const std::string_view beginning = file.substr(0, kMaxPlyHeaderBytes);
  for (size_t at = beginning.find("end_header"); at != std::string_view::npos;
       at = beginning.find("end_header", at + 1)) {
    if (at == 0 || (beginning[at - 1] != '\n' && beginning[at - 1] != '\r')) continue;
    return after_line(file, at);
  }
  return 0;
}

}  // namespace

std::optional<size_t> PlyElement::find(std::initializer_list<std::string_view> names, bool is_list) const {
  for (size_t i = 0; i < property.size(); ++i) {
    if (property[i].count_type.has_value() != is_list) continue;
    if (std::find(names.begin(), names.end(), property[i].name) != names.end()) return i;
  }
  return std::nullopt;
}

Result<PlyHeader> read_ply_header(std::string_view file) {
  TextScan begin(file.substr(0, kMaxPlyHeaderBytes));
  if (!file.starts_with("ply") || !begin.next_line() || begin.next_word() != "ply" ||
      !begin.next_word().empty())
    return make_error(ErrorCode::BadInput, "does not begin with the line 'ply': not a .ply file");
  PlyHeader header;
  header.body_at = header_bytes(file);
  if (header.body_at == 0)
    return make_error(ErrorCode::BadInput, "no line 'end_header' in the first {} bytes", kMaxPlyHeaderBytes);
  TextScan scan(file.substr(0, header.body_at));
  bool has_format = false;
  scan.next_filled_line();  // "ply"
  while (scan.next_filled_line()) {
    TextScan ahead = scan;
    if (ahead.next_word() == "end_header") break;
    RETURN_IF_ERROR(add_line(scan, header, has_format));
  }
  if (!has_format) return make_error(ErrorCode::BadInput, "the header has no line 'format'");
  for (const PlyElement& element : header.element) {
    // Rows without anything in them would take no bytes: their number says nothing about the file.
    if (element.property.empty() && element.row_count > 0)
      return make_error(ErrorCode::BadInput, "element {} has rows and no property",
                        strandcast::quoted(element.name));
  }
  return header;
}

Error PlyRows::ended(std::string_view what) {
  has_ended_ = true;
  return make_error(ErrorCode::BadInput, "{}", what);
}

Result<double> PlyRows::next_word(PlyType type) {
  constexpr std::string_view kSpace = " \t\r\n\v\f";
  at_ = std::min(text_.find_first_not_of(kSpace, at_), text_.size());
  if (at_ == text_.size()) return ended("the file ends there");
  const size_t end = std::min(text_.find_first_of(kSpace, at_), text_.size());
  const std::string_view word = text_.substr(at_, end - at_);
  at_ = end;
  auto value = parse_number<double>(word);
  if (!value && word.size() <= kMaxPlyNumberChars) {
    std::string with_point(word);
    std::replace(with_point.begin(), with_point.end(), ',', '.');
    value = parse_number<double>(with_point);
    decimal_commas_ += value ? 1 : 0;
  }
  const bool is_whole = type < PlyType::Float32;
  if (!value && !is_whole) return std::numeric_limits<double>::quiet_NaN();
  if (!value) return make_error(ErrorCode::BadInput, "{} is no number", quoted(word));
  if (is_whole && *value != std::floor(*value))
    return make_error(ErrorCode::BadInput, "{} is no whole number", quoted(word));
  return *value;
}

Result<double> PlyRows::next(PlyType type) {
  if (format_ == PlyFormat::Text) return next_word(type);
  const size_t bytes = named(type).bytes;
  if (text_.size() - at_ < bytes) return ended("the file ends there");
  uint64_t bits = 0;
  for (size_t i = 0; i < bytes; ++i) {
    const auto byte = static_cast<uint8_t>(text_[at_ + i]);
    bits |= uint64_t{byte} << (8 * (format_ == PlyFormat::LittleEndian ? i : bytes - 1 - i));
  }
  at_ += bytes;
  switch (type) {
    case PlyType::Int8:
      return static_cast<double>(static_cast<int8_t>(bits));
    case PlyType::Int16:
      return static_cast<double>(static_cast<int16_t>(bits));
    case PlyType::Int32:
      return static_cast<double>(static_cast<int32_t>(bits));
    case PlyType::Float32:
      return static_cast<double>(std::bit_cast<float>(static_cast<uint32_t>(bits)));
    case PlyType::Float64:
      return std::bit_cast<double>(bits);
    default:
      return static_cast<double>(bits);
  }
}

Status PlyRows::read(const PlyElement& element, uint64_t row) {
  value_.clear();
  begin_.assign(1, 0);
  for (const PlyProperty& property : element.property) {
    const auto fail = [&](const Error& error) {
      return at(fmt::format("{} {} {}", one_line(element.name, 40), row, one_line(property.name, 40)), error);
    };
    double count = 1.0;
    if (property.count_type) {
      const auto read_count = next(*property.count_type);
      if (!read_count) return fail(read_count.error());
      count = *read_count;
      // Every value takes a byte at least, so that a length beyond the rest of the file allocates nothing.
      if (!(count >= 0.0)) return fail(make_error(ErrorCode::BadInput, "a list of {} values", count));
      if (count > static_cast<double>(text_.size() - at_))
        return fail(ended(fmt::format("a list of {} values, the file ends before", count)));
    }
    for (double i = 0.0; i < count; i += 1.0) {
      const auto value = next(property.type);
      if (!value) return fail(value.error());
      value_.push_back(*value);
    }
    begin_.push_back(value_.size());
  }
  return {};
}

size_t PlyRows::left_bytes() const {
  if (format_ != PlyFormat::Text) return text_.size() - at_;
  const size_t word = text_.find_first_not_of(" \t\r\n\v\f", at_);
  return word == std::string_view::npos ? 0 : text_.size() - word;
}

}  // namespace strandcast
