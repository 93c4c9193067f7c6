#include "common/groom/usda_scan.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "common/groom/text_scan.h"

namespace strandcast {
namespace {

constexpr double kMostCount = 4e9;  // fits 32 bits

bool is_word_char(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return std::isalnum(byte) != 0 || byte >= 0x80 ||
         std::string_view("_:.+-!").find(c) != std::string_view::npos;
}

/// The number of a word with a decimal comma.
std::optional<double> with_decimal_point(std::string_view word) {
  std::string pointed(word);
  std::replace(pointed.begin(), pointed.end(), ',', '.');
  return parse_number<double>(pointed);
}

/// The point of "1,5, 2,5, 3,5"; empty where it is none.
std::optional<glm::vec3> point_of_decimal_commas(std::string_view text) {
  glm::vec3 point{0.0f};
  for (int axis = 0; axis < 3; ++axis) {
    text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
    const size_t end = std::min(text.find_first_of(" \t"), text.size());
    std::string_view word = text.substr(0, end);
    text.remove_prefix(end);
    if (axis < 2 && !word.ends_with(',')) return std::nullopt;
    if (axis < 2) word.remove_suffix(1);
    const auto value = with_decimal_point(word);
    if (!value) return std::nullopt;
    point[axis] = static_cast<float>(*value);
  }
  return text.find_first_not_of(" \t\r\n") == std::string_view::npos ? std::optional(point) : std::nullopt;
}

char closing_of(char opening) {
  return opening == '(' ? ')' : opening == '[' ? ']' : '}';
}

}  // namespace

void UsdaScan::skip_space() {
  while (at_ < text_.size()) {
    const char c = text_[at_];
    if (c == '#') {
      at_ = std::min(text_.find_first_of("\r\n", at_), text_.size());
    } else if (c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == ';') {
      ++at_;
    } else {
      return;
    }
  }
}

char UsdaScan::peek() {
  skip_space();
  return at_ < text_.size() ? text_[at_] : '\0';
}

bool UsdaScan::take(char c) {
  if (peek() != c) return false;
  ++at_;
  return true;
}

Status UsdaScan::expect(char c) {
  if (take(c)) return {};
  return error(ErrorCode::BadInput, "{} found where '{}' is needed", found(), c);
}

std::string UsdaScan::found() {
  if (is_at_end()) return "the end of the file";
  TextScan line(text_.substr(at_, 200));
  line.next_line();
  return quoted(line.next_word());
}

size_t UsdaScan::line() const {
  TextScan lines(text_.substr(0, at_));
  while (lines.next_line()) {
  }
  const bool is_at_begin = at_ == 0 || text_[at_ - 1] == '\n' || text_[at_ - 1] == '\r';
  return lines.line() + (is_at_begin ? 1 : 0);
}

std::string_view UsdaScan::word() {
  skip_space();
  const size_t begin = at_;
  while (at_ < text_.size() && is_word_char(text_[at_])) ++at_;
  return text_.substr(begin, at_ - begin);
}

Result<std::string_view> UsdaScan::string() {
  const char quote = peek();
  if (quote != '"' && quote != '\'') return error(ErrorCode::BadInput, "{} is no string", found());
  const std::string three(3, quote);
  const bool is_long = text_.substr(at_, 3) == three;
  const size_t begin = at_ + (is_long ? 3 : 1);
  for (size_t i = begin; i < text_.size(); ++i) {
    if (text_[i] == '\\') {
      ++i;
    } else if (!is_long && text_[i] == '\n') {
      return error(ErrorCode::BadInput, "a string without an end");
    } else if (text_[i] == quote && (!is_long || text_.substr(i, 3) == three)) {
      at_ = i + (is_long ? 3 : 1);
      return text_.substr(begin, i - begin);
    }
  }
  at_ = text_.size();
  return error(ErrorCode::BadInput, "a string without an end");
}

Result<double> UsdaScan::number() {
  const size_t begin = (skip_space(), at_);
  const std::string_view text = word();
  const auto value = parse_number<double>(text);
  if (value) return *value;
  at_ = begin;
  return error(ErrorCode::BadInput, "{} is no number", found());
}

Result<double> UsdaScan::scalar() {
  const size_t begin = (skip_space(), at_);
  ASSIGN_OR_RETURN(const double value, number());
  const bool has_comma = text_.substr(at_).starts_with(',') && at_ + 1 < text_.size() &&
                         std::isdigit(static_cast<unsigned char>(text_[at_ + 1])) != 0;
  if (!has_comma) return value;
  ++at_;
  word();
  const auto pointed = with_decimal_point(text_.substr(begin, at_ - begin));
  if (!pointed) return error(ErrorCode::BadInput, "'{}' is no number", text_.substr(begin, at_ - begin));
  ++decimal_commas_;
  return *pointed;
}

Result<double> UsdaScan::number_or_nan() {
  const size_t begin = (skip_space(), at_);
  std::string_view text = word();
  // "-1.#IND" of some C libraries: no comment begins there.
  const bool is_cut = text.ends_with("1.") && text_.substr(at_).starts_with('#');
  if (is_cut && at_ + 1 < text_.size() && std::isupper(static_cast<unsigned char>(text_[at_ + 1])) != 0) {
    ++at_;
    word();
    text = text_.substr(begin, at_ - begin);
  }
  if (text.empty()) return error(ErrorCode::BadInput, "{} is no number", found());
  return parse_number<double>(text).value_or(std::numeric_limits<double>::quiet_NaN());
}

Result<double> UsdaScan::time_code() {
  skip_space();
  // Names hold colons, numbers do not.
  const size_t end = std::min(text_.find_first_of(": \t\r\n", at_), text_.size());
  const std::string_view text = text_.substr(at_, end - at_);
  const auto value = parse_number<double>(text);
  if (!value || !std::isfinite(*value)) return error(ErrorCode::BadInput, "{} is no time", found());
  at_ = end;
  RETURN_IF_ERROR(expect(':'));
  return *value;
}

bool UsdaScan::take_none() {
  const size_t begin = (skip_space(), at_);
  if (word() == "None") return true;
  at_ = begin;
  return false;
}

Result<std::vector<double>> UsdaScan::numbers(size_t limit) {
  std::vector<double> values;
  if (take_none()) return values;
  std::string open;  // closing brackets that are due, the next one last
  do {
    const char c = peek();
    if (c == '(' || c == '[') {
      if (open.size() == kMaxUsdDepth) return error(ErrorCode::LimitExceeded, "too many brackets");
      take(c);
      open += closing_of(c);
    } else if (!open.empty() && take(open.back())) {
      open.pop_back();
    } else {
      if (values.size() == limit) return error(ErrorCode::LimitExceeded, "more than {} numbers", limit);
      ASSIGN_OR_RETURN(const double value, number_or_nan());
      values.push_back(value);
    }
    if (!open.empty() && !values.empty()) take(',');
  } while (!open.empty());
  return values;
}

template <class T, class ReadItem>
Result<std::vector<T>> UsdaScan::array(size_t limit, const ReadItem& read_item) {
  std::vector<T> items;
  if (take_none()) return items;
  RETURN_IF_ERROR(expect('['));
  // Where the file is cut off, what came before counts: who reads on meets its end.
  while (!take(']')) {
    if (items.size() == limit)
      return error(ErrorCode::LimitExceeded, "an array of more than {} values", limit);
    const auto item = read_item();
    if (is_at_end()) return items;
    if (!item) return item.error();
    items.push_back(*item);
    if (take(',')) continue;
    RETURN_IF_ERROR(expect(']'));
    break;
  }
  return items;
}

Result<std::vector<glm::vec3>> UsdaScan::points(size_t limit) {
  return array<glm::vec3>(limit, [this]() -> Result<glm::vec3> {
    glm::vec3 point{0.0f};
    RETURN_IF_ERROR(expect('('));
    const size_t begin = at_;
    for (int axis = 0; axis < 3; ++axis) {
      if (axis > 0 && !take(',')) return odd_point(begin);
      const auto value = number_or_nan();
      if (!value) return odd_point(begin);
      point[axis] = static_cast<float>(*value);
    }
    return take(')') ? Result<glm::vec3>(point) : odd_point(begin);
  });
}

Result<glm::vec3> UsdaScan::odd_point(size_t begin) {
  at_ = std::min(text_.find_first_of("()[]{}", begin), text_.size());
  if (is_at_end() || text_[at_] != ')')
    return error(ErrorCode::BadInput, "{} found where ')' is needed", found());
  const auto point = point_of_decimal_commas(text_.substr(begin, at_ - begin));
  ++at_;
  decimal_commas_ += point ? 1 : 0;
  return point.value_or(glm::vec3(std::numeric_limits<float>::quiet_NaN()));
}

Result<std::vector<float>> UsdaScan::floats(size_t limit) {
  return array<float>(limit, [this]() -> Result<float> {
    ASSIGN_OR_RETURN(const double value, number_or_nan());
    return static_cast<float>(value);
  });
}

Result<std::vector<uint32_t>> UsdaScan::counts(size_t limit) {
  return array<uint32_t>(limit, [this]() -> Result<uint32_t> {
    ASSIGN_OR_RETURN(const double value, number());
    if (value >= 0.0 && value <= kMostCount && value == std::floor(value))
      return static_cast<uint32_t>(value);
    return error(ErrorCode::BadInput, "{} is no number of vertices", value);
  });
}

Result<std::vector<std::string_view>> UsdaScan::strings(size_t limit) {
  return array<std::string_view>(limit, [this] { return string(); });
}

/// An asset's path between @ or @@@, or a prim's between < and >.
Status UsdaScan::skip_quoted_path(char quote) {
  const bool is_long = quote == '@' && text_.substr(at_, 3) == "@@@";
  const std::string_view end = quote == '<' ? ">" : is_long ? "@@@" : "@";
  const size_t found_at = text_.find(end, at_ + end.size());
  if (found_at == std::string_view::npos) {
    at_ = text_.size();
    return error(ErrorCode::BadInput, "a path without an end");
  }
  at_ = found_at + end.size();
  return {};
}

Status UsdaScan::skip_rest(char closing) {
  std::string open(1, closing);
  while (!open.empty()) {
    // Most of a file is such values: look for what matters and for nothing else.
    at_ = std::min(text_.find_first_of("()[]{}\"'#@<", at_), text_.size());
    if (at_ == text_.size()) return error(ErrorCode::BadInput, "the file ends before '{}'", open.back());
    const char c = text_[at_];
    if (c == open.back()) {
      open.pop_back();
      ++at_;
    } else if (c == '(' || c == '[' || c == '{') {
      if (open.size() == kMaxUsdDepth) return error(ErrorCode::LimitExceeded, "too many brackets");
      open += closing_of(c);
      ++at_;
    } else if (c == '"' || c == '\'') {
      ASSIGN_OR_RETURN([[maybe_unused]] const std::string_view text, string());
    } else if (c == '#') {
      skip_space();
    } else if (c == '@' || c == '<') {
      RETURN_IF_ERROR(skip_quoted_path(c));
    } else {
      return error(ErrorCode::BadInput, "'{}' found where '{}' is needed", c, open.back());
    }
  }
  return {};
}

Status UsdaScan::skip_value() {
  const char c = peek();
  if (c == '(' || c == '[' || c == '{') {
    take(c);
    return skip_rest(closing_of(c));
  }
  if (c == '"' || c == '\'') {
    ASSIGN_OR_RETURN([[maybe_unused]] const std::string_view text, string());
    return {};
  }
  if (c == '@' || c == '<') {
    RETURN_IF_ERROR(skip_quoted_path(c));
    if (c == '@' && peek() == '<') RETURN_IF_ERROR(skip_quoted_path('<'));
    // Times of what is referred to.
    return take('(') ? skip_rest(')') : Status();
  }
  if (word().empty()) return error(ErrorCode::BadInput, "{} is no value", found());
  return {};
}

}  // namespace strandcast
