// Result<T>: a value or an Error that a caller can act on. Any thread. Broken invariants use check.h instead.
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace strandcast {

enum class ErrorCode {
  BadInput,       // bytes, text or numbers from outside are wrong
  NotFound,       // a file, joint, solver or host does not exist
  LimitExceeded,  // a named limit was passed
  Unsupported,    // understood, but this build or device cannot do it
  Unavailable,    // port in use, no EGL, peer gone
  Unauthorized,   // token, origin or role refused
  Timeout,
  Internal,  // ours: please report
};

/// Returns the printed name of an error code, for example "bad input".
const char* to_string(ErrorCode code);

struct Error {
  ErrorCode code = ErrorCode::Internal;
  std::string message;  // one sentence naming the offending value and what is allowed
  std::string place;    // file, byte offset or line:column, field path; may be empty

  // Out of line: every function that returns a Result takes one apart.
  Error();
  Error(ErrorCode kind, std::string sentence, std::string where = {});
  Error(const Error&);
  Error(Error&&) noexcept;
  Error& operator=(const Error&);
  Error& operator=(Error&&) noexcept;
  ~Error();

  /// Formats the error as "place: message", or as the message alone if there is no place.
  std::string to_string() const;
};

/// Makes an Error with a formatted message and no place.
template <class... Args>
Error make_error(ErrorCode code, fmt::format_string<Args...> format, Args&&... args) {
  return Error{code, fmt::format(format, std::forward<Args>(args)...), {}};
}

/// Returns the error with `place` put in front of the place that it already names.
Error at(std::string place, Error error);

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}
  Result(Error error) : state_(std::move(error)) {}

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}

  bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  const Error& error() const { return *error_; }

 private:
  std::optional<Error> error_;
};

using Status = Result<void>;

}  // namespace strandcast

#define STRANDCAST_CONCAT_(a, b) a##b
#define STRANDCAST_CONCAT(a, b) STRANDCAST_CONCAT_(a, b)

/// Returns from the enclosing function with the error of `expression`, if it has one.
#define RETURN_IF_ERROR(expression)                                                               \
  do {                                                                                            \
    if (auto return_if_error_ = (expression); !return_if_error_) return return_if_error_.error(); \
  } while (false)

/// Initialises `declaration` with the value of `expression`, or returns its error from the enclosing
/// function.
#define ASSIGN_OR_RETURN(declaration, expression) \
  ASSIGN_OR_RETURN_(STRANDCAST_CONCAT(assign_or_return_, __LINE__), declaration, expression)
#define ASSIGN_OR_RETURN_(temporary, declaration, expression) \
  auto temporary = (expression);                              \
  if (!temporary) return temporary.error();                   \
  declaration = std::move(temporary).value()
