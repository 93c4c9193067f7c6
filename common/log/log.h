// Logging: one logger per process, tags are the stage names (input, scene, sim, publish, encode, net, replay,
// render). Any thread. Never waits for whoever reads the log, and cleans what it writes: texts of strangers
// may stand in it. Levels: error = a person must act, warn = degraded, info = state changes, debug = for
// developers. Never logs tokens.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace strandcast {

enum class LogLevel { Debug, Info, Warn, Error };

/// Longest message of one line; the rest is cut.
inline constexpr size_t kMaxLogMessageChars = 2'000;

/// How a line looks: for people, or one JSON object with time (UTC), level, tag and message, for programs.
enum class LogFormat { Text, Json };

/// Sends logs to standard error at `level` ("debug", "info", "warn", "error", "off"); false if unknown. A
/// reader of the process's output that goes away no longer ends it (SIGPIPE is ignored from here on).
bool init_log(const std::string& level, LogFormat format = LogFormat::Text);

bool is_logged(LogLevel level);
/// One line; `message` is cleaned as by one_line().
void log_line(LogLevel level, const char* tag, std::string_view message);
/// Lines that found no room on standard error, since start.
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
