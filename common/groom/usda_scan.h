// UsdaScan: reads words, numbers, strings and arrays of USD text, and skips values of any type. Strict:
// malformed text is an error with its line. Views into the text, which must outlive it. Private to the
// loader; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "common/groom/usd_stage.h"

namespace strandcast {

class UsdaScan {
 public:
  explicit UsdaScan(std::string_view text) : text_(text) {}

  /// Skips spaces, line ends, semicolons and comments.
  void skip_space();
  /// Skips space and returns the next character without consuming it; 0 at the end.
  char peek();
  bool is_at_end() { return peek() == 0; }
  /// Skips space and consumes the next character if it is `c`; returns whether it was.
  bool take(char c);
  Status expect(char c);

  /// Reads the next name or number: letters, digits and "_:.+-!". Empty if there is none.
  std::string_view word();
  /// Reads a string in any of USD's quotes; escapes are not resolved. BadInput if there is none.
  Result<std::string_view> string();
  Result<double> number();
  /// Reads a number that no other follows, also with a decimal comma.
  Result<double> scalar();
  /// Returns the next of many numbers, NaN for a word that is no number, so that it costs its strand alone.
  Result<double> number_or_nan();
  /// Reads the time before a time sample, as in "1.5 :".
  Result<double> time_code();

  /// Reads all numbers of a value (scalar, tuple or matrix) in text order, through all brackets; at most
  /// `limit`. Empty for "None".
  Result<std::vector<double>> numbers(size_t limit);
  /// Reads points. One of other than three numbers is NaN, so that it costs its strand alone.
  Result<std::vector<glm::vec3>> points(size_t limit);
  Result<std::vector<float>> floats(size_t limit);
  Result<std::vector<uint32_t>> counts(size_t limit);
  Result<std::vector<std::string_view>> strings(size_t limit);

  /// Skips a value of any type.
  Status skip_value();
  /// Skips from inside brackets past the matching closing one.
  Status skip_rest(char closing);

  /// Makes an error that names the current line.
  template <class... Args>
  Error error(ErrorCode code, fmt::format_string<Args...> format, Args&&... args) const {
    return at(fmt::format("line {}", line()), make_error(code, format, std::forward<Args>(args)...));
  }
  /// Returns how many scalars and points had decimal commas.
  uint64_t decimal_commas() const { return decimal_commas_; }
  /// Quotes the next characters for an error message.
  std::string found();

 private:
  size_t line() const;
  Status skip_quoted_path(char quote);
  bool take_none();
  /// A point that is not written as USD does; `begin` is behind its bracket.
  Result<glm::vec3> odd_point(size_t begin);
  template <class T, class ReadItem>
  Result<std::vector<T>> array(size_t limit, const ReadItem& read_item);

  std::string_view text_;
  size_t at_ = 0;
  uint64_t decimal_commas_ = 0;
};

}  // namespace strandcast
