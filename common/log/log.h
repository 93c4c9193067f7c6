// Logging: one logger per process; tags are stage names (input, scene, sim, publish, encode, net, replay,
// render). Any thread. Never waits for the reader of the log. Texts from outside are cleaned before they are
// written. Levels: error = a person must act, warn = degraded, info = state changes, debug = for developers.
// Never logs tokens.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace strandcast {

enum class LogLevel { Debug, Info, Warn, Error };

/// Longest message of one line, in characters; longer messages are cut.
inline constexpr size_t kMaxLogMessageChars = 2'000;

/// Format of a line: text for people, or for programs a JSON object with time (UTC), level, tag and message.
enum class LogFormat { Text, Json };

/// Sends logs to standard error at `level` ("debug", "info", "warn", "error", "off"); returns false for an
/// unknown level. From then on SIGPIPE is ignored, so a closed standard error does not end the process.
bool init_log(const std::string& level, LogFormat format = LogFormat::Text);

bool is_logged(LogLevel level);
/// Logs one line; `message` is cleaned by one_line().
void log_line(LogLevel level, const char* tag, std::string_view message);
/// Number of lines since start that were dropped because standard error could not take them.
uint64_t dropped_log_lines();

template <class... Args>
void log_info(const char* tag, fmt::format_string<Args...> format, Args&&... args) {
  log_line(LogLevel::Info, tag, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void log_warn(const char* tag, fmt::format_string<Args...> format, Args&&... args) {
  log_line(LogLevel::Warn, tag, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void log_error(const char* tag, fmt::format_string<Args...> format, Args&&... args) {
  log_line(LogLevel::Error, tag, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void log_debug(const char* tag, fmt::format_string<Args...> format, Args&&... args) {
  if (is_logged(LogLevel::Debug))
    log_line(LogLevel::Debug, tag, fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace strandcast
