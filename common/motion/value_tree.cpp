#include "common/motion/value_tree.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "common/base/text.h"
#include "common/motion/value_tree_private.h"

namespace strandcast {
namespace {

// ---- JSON

void append_utf8(std::string& text, uint32_t code) {
  const auto put = [&](uint32_t bits) { text += static_cast<char>(bits); };
  const auto put_rest = [&](int shift) { put(0x80 | ((code >> shift) & 0x3F)); };
  if (code < 0x80) return put(code);
  if (code < 0x800) {
    put(0xC0 | code >> 6);
  } else if (code < 0x10000) {
    put(0xE0 | code >> 12);
    put_rest(6);
  } else {
    put(0xF0 | code >> 18);
    put_rest(12);
    put_rest(6);
  }
  put_rest(0);
}

class JsonReader {
 public:
  explicit JsonReader(std::string_view text) : text_(text) {}

  Result<ValueTree> read() {
    ASSIGN_OR_RETURN(ValueTree tree, read_value(1));
    skip_blanks();
    if (at_ != text_.size()) return tree_error(at_, "something stands behind the document");
    return tree;
  }

 private:
  void skip_blanks() {
    while (at_ < text_.size() && std::strchr(" \t\r\n", text_[at_]) != nullptr && text_[at_] != '\0') ++at_;
  }
  bool take(char letter) {
    skip_blanks();
    if (at_ >= text_.size() || text_[at_] != letter) return false;
    ++at_;
    return true;
  }
  bool take_word(std::string_view word) {
    if (!text_.substr(at_).starts_with(word)) return false;
    at_ += word.size();
    return true;
  }

  Result<ValueTree> read_value(size_t depth) {
    RETURN_IF_ERROR(budget_.take(depth));
    if (take('{')) return read_map(depth);
    if (take('[')) return read_list(depth);
    if (at_ < text_.size() && text_[at_] == '"') {
      ASSIGN_OR_RETURN(std::string text, read_text());
      return ValueTree{std::move(text)};
    }
    if (take_word("true")) return ValueTree{true};
    if (take_word("false")) return ValueTree{false};
    if (take_word("null")) return ValueTree{};
    return read_number();
  }

  Result<ValueTree> read_map(size_t depth) {
    ValueTree::Map map;
    if (take('}')) return ValueTree{std::move(map)};
    do {
      skip_blanks();
      if (at_ >= text_.size() || text_[at_] != '"') return tree_error(at_, "a key in quotes is missing");
      ASSIGN_OR_RETURN(std::string key, read_text());
      if (!take(':')) return tree_error(at_, "a colon is missing");
      ASSIGN_OR_RETURN(ValueTree value, read_value(depth + 1));
      map.emplace_back(std::move(key), std::move(value));
    } while (take(','));
    if (!take('}')) return tree_error(at_, "a comma or } is missing");
    return ValueTree{std::move(map)};
  }

  Result<ValueTree> read_list(size_t depth) {
    ValueTree::List list;
    if (take(']')) return ValueTree{std::move(list)};
    do {
      ASSIGN_OR_RETURN(ValueTree value, read_value(depth + 1));
      list.push_back(std::move(value));
    } while (take(','));
    if (!take(']')) return tree_error(at_, "a comma or ] is missing");
    return ValueTree{std::move(list)};
  }

  Result<ValueTree> read_number() {
    const size_t end = std::min(text_.find_first_not_of("+-.0123456789eE", at_), text_.size());
    const std::string_view digits = text_.substr(at_, end - at_);
    const size_t first = digits.starts_with('-') ? 1 : 0;
    const bool is_begun = digits.size() > first && digits[first] >= '0' && digits[first] <= '9';
    const bool has_zeros = digits.size() > first + 1 && digits[first] == '0' && digits[first + 1] >= '0' &&
                           digits[first + 1] <= '9';
    double number = 0.0;
    const auto [stop, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (!is_begun || has_zeros || failure != std::errc{} || stop != digits.data() + digits.size())
      return tree_error(at_, "no value of JSON begins so");
    at_ = end;
    return ValueTree{number};
  }

  Result<std::string> read_text() {
    const size_t begin = at_++;
    std::string text;
    while (at_ < text_.size() && text_[at_] != '"') {
      if (text_[at_] == '\\') {
        RETURN_IF_ERROR(read_escape(text));
        continue;
      }
      const size_t bytes = utf8_length(text_, at_);
      if (bytes == 0 || static_cast<unsigned char>(text_[at_]) < ' ')
        return tree_error(at_, "a byte that no text has");
      text += text_.substr(at_, bytes);
      at_ += bytes;
    }
    if (at_ >= text_.size()) return tree_error(begin, "a text without an end");
    ++at_;
    return text;
  }

  Status read_escape(std::string& text) {
    constexpr std::string_view kLetters = "\"\\/bfnrt", kMeanings = "\"\\/\b\f\n\r\t";
    const size_t begin = at_++;
    const char letter = at_ < text_.size() ? text_[at_] : '\0';
    ++at_;
    if (const size_t found = kLetters.find(letter); found != std::string_view::npos) {
      text += kMeanings[found];
      return {};
    }
    if (letter != 'u') return tree_error(begin, "an escape that JSON has not");
    ASSIGN_OR_RETURN(uint32_t code, read_code(begin));
    const auto is_half = [](uint32_t one, uint32_t first) { return one >= first && one < first + 0x400; };
    if (is_half(code, 0xD800) && take_word("\\u")) {
      ASSIGN_OR_RETURN(const uint32_t low, read_code(begin));
      if (!is_half(low, 0xDC00)) return tree_error(begin, "half a character");
      code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
    }
    if (is_half(code, 0xD800) || is_half(code, 0xDC00)) return tree_error(begin, "half a character");
    append_utf8(text, code);
    return {};
  }

  Result<uint32_t> read_code(size_t begin) {
    constexpr size_t kDigits = 4;
    uint32_t code = 0;
    const std::string_view digits = text_.substr(std::min(at_, text_.size()), kDigits);
    const auto [stop, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), code, 16);
    if (digits.size() != kDigits || failure != std::errc{} || stop != digits.data() + kDigits)
      return tree_error(begin, "an escape without four digits");
    at_ += kDigits;
    return code;
  }

  std::string_view text_;
  size_t at_ = 0;
  TreeBudget budget_;
};

void append_json_text(std::string& out, std::string_view text) {
  out += '"';
  for (const char letter : text) {
    const auto code = static_cast<unsigned char>(letter);
    if (letter == '"' || letter == '\\') out += '\\';
    if (code < ' ')
      out += fmt::format("\\u{:04x}", code);
    else
      out += letter;
  }
  out += '"';
}

void append_json(std::string& out, const ValueTree& tree) {
  if (const auto number = tree.number()) {
    out += std::isfinite(*number) ? fmt::format("{}", *number) : "null";
  } else if (const auto truth = tree.truth()) {
    out += *truth ? "true" : "false";
  } else if (tree.text() != nullptr) {
    append_json_text(out, *tree.text());
  } else if (const auto* list = tree.list()) {
    out += '[';
    for (size_t i = 0; i < list->size(); ++i) {
      if (i > 0) out += ',';
      append_json(out, (*list)[i]);
    }
    out += ']';
  } else if (const auto* map = std::get_if<ValueTree::Map>(&tree.value)) {
    out += '{';
    for (size_t i = 0; i < map->size(); ++i) {
      if (i > 0) out += ',';
      append_json_text(out, (*map)[i].first);
      out += ':';
      append_json(out, (*map)[i].second);
    }
    out += '}';
  } else {
    out += "null";
  }
}

}  // namespace

const ValueTree* ValueTree::find(std::string_view key) const {
  const auto* map = std::get_if<Map>(&value);
  if (map == nullptr) return nullptr;
  const auto found =
      std::find_if(map->begin(), map->end(), [&](const auto& one) { return one.first == key; });
  return found == map->end() ? nullptr : &found->second;
}

std::optional<double> ValueTree::number() const {
  const auto* found = std::get_if<double>(&value);
  return found == nullptr ? std::nullopt : std::optional(*found);
}

std::optional<bool> ValueTree::truth() const {
  const auto* found = std::get_if<bool>(&value);
  return found == nullptr ? std::nullopt : std::optional(*found);
}

Result<ValueTree> read_json(std::string_view text) {
  return JsonReader(text).read();
}

std::string write_json(const ValueTree& tree) {
  std::string out;
  append_json(out, tree);
  return out;
}

}  // namespace strandcast
