// UsdaScan: words, numbers, strings and arrays of USD's text form, and whatever value nobody asks for, in one
// step. Strict: what is no USD is an error with its line. Views into the text, which must outlive it.
// Private to the loader; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

inline constexpr size_t kMaxUsdaDepth = 64;  // of brackets, and of prims in each other

class UsdaScan {
 public:
  explicit UsdaScan(std::string_view text) : text_(text) {}

  /// Past spaces, line ends, semicolons and comments.
  void skip_space();
  /// After spaces: the next character, 0 at the end.
  char peek();
  bool is_at_end() { return peek() == 0; }
  /// Takes the character when it is the next one after spaces.
  bool take(char c);
  Status expect(char c);

  /// The next name or number: letters, digits and "_:.+-!". Empty when there is none.
  std::string_view word();
  /// A whole string in any of USD's quotes, escapes as they stand; BadInput when there is none.
  Result<std::string_view> string();
  Result<double> number();
  /// "1.5 :", what stands before a time sample.
  Result<double> time_code();

  /// Numbers of a value in the order of the text, through all brackets: of a scalar, tuple or matrix; at most
  /// `limit`. Empty for "None".
  Result<std::vector<double>> numbers(size_t limit);
  Result<std::vector<glm::vec3>> points(size_t limit);
  Result<std::vector<float>> floats(size_t limit);
  Result<std::vector<uint32_t>> counts(size_t limit);
  Result<std::vector<std::string_view>> strings(size_t limit);

  /// Past a value of any type.
  Status skip_value();
  /// From the inside of brackets past the one that closes them.
  Status skip_rest(char closing);

  /// With the line that the scan has come to.
  template <class... Args>
  Error error(ErrorCode code, fmt::format_string<Args...> format, Args&&... args) const {
    return at(fmt::format("line {}", line()), make_error(code, format, std::forward<Args>(args)...));
  }
  /// What stands next, for an error.
  std::string found();

 private:
  size_t line() const;
  Status skip_quoted_path(char quote);
  bool take_none();
  template <class T, class ReadItem>
  Result<std::vector<T>> array(size_t limit, const ReadItem& read_item);

  std::string_view text_;
  size_t at_ = 0;
};

}  // namespace strandcast
