// Logging through spdlog: one logger per process, tags are the stage names (input, scene, sim, publish,
// encode, net, replay, render). Any thread. Levels: error = a person must act, warn = degraded, info = state
// changes, debug = for developers. Never logs tokens.
#pragma once

#include <spdlog/spdlog.h>

#include <string>

namespace strandcast {

/// Sends logs to standard error at `level` ("debug", "info", "warn", "error", "off"); false if unknown.
bool init_log(const std::string& level);

template <class... Args>
void log_info(const char* tag, fmt::format_string<Args...> format, Args&&... args) {
  spdlog::info("[{}] {}", tag, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void log_warn(const char* tag, fmt::format_string<Args...> format, Args&&... args) {
  spdlog::warn("[{}] {}", tag, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void log_error(const char* tag, fmt::format_string<Args...> format, Args&&... args) {
  spdlog::error("[{}] {}", tag, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void log_debug(const char* tag, fmt::format_string<Args...> format, Args&&... args) {
  if (spdlog::should_log(spdlog::level::debug))
    spdlog::debug("[{}] {}", tag, fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace strandcast
