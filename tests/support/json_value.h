// JSON as a tree, for tests that read what others wrote. Strict enough for good files; a bad one fails a
// check.
#pragma once

#include <charconv>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/check.h"

namespace strandcast::test {

struct JsonValue {
  double number = 0.0;  // 1 for true
  bool is_null = false;
  std::string text;
  std::vector<JsonValue> items;
  std::map<std::string, JsonValue> fields;

  bool has(const std::string& name) const { return fields.contains(name) && !fields.at(name).is_null; }
  const JsonValue& operator[](const std::string& name) const { return fields.at(name); }
  std::vector<double> numbers() const {
    std::vector<double> values;
    for (const JsonValue& item : items) values.push_back(item.number);
    return values;
  }
};

class JsonScan {
 public:
  explicit JsonScan(std::string_view text) : text_(text) {}

  JsonValue value() {
    JsonValue read;
    if (take('{')) {
      while (!take('}')) {
        const std::string name = string();
        CHECK(take(':'));
        read.fields[name] = value();
        (void)take(',');
      }
    } else if (take('[')) {
      while (!take(']')) {
        read.items.push_back(value());
        (void)take(',');
      }
    } else if (peek() == '"') {
      read.text = string();
    } else if (take_word("true")) {
      read.number = 1.0;
    } else if (take_word("null")) {
      read.is_null = true;
    } else if (!take_word("false")) {
      const auto [end, code] = std::from_chars(text_.data(), text_.data() + text_.size(), read.number);
      CHECK(code == std::errc{});
      text_.remove_prefix(static_cast<size_t>(end - text_.data()));
    }
    return read;
  }

 private:
  char peek() {
    text_.remove_prefix(std::min(text_.find_first_not_of(" \t\r\n"), text_.size()));
    return text_.empty() ? '\0' : text_.front();
  }
  bool take(char c) {
    if (peek() != c) return false;
    text_.remove_prefix(1);
    return true;
  }
  bool take_word(std::string_view word) {
    (void)peek();
    if (!text_.starts_with(word)) return false;
    text_.remove_prefix(word.size());
    return true;
  }
  /// Escapes but those of quotes and backslashes stay as they are written.
  std::string string() {
    CHECK(take('"'));
    std::string read;
    while (text_.front() != '"') {
      if (text_.front() == '\\' && (text_[1] == '"' || text_[1] == '\\')) text_.remove_prefix(1);
      read += text_.front();
      text_.remove_prefix(1);
    }
    text_.remove_prefix(1);
    return read;
  }

  std::string_view text_;
};

}  // namespace strandcast::test
