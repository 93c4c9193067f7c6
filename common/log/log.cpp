#include "common/log/log.h"

#include <spdlog/details/os.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <mutex>

#include "common/base/text.h"
#include "common/log/line_writer.h"

namespace strandcast {
namespace {

spdlog::level::level_enum spdlog_level(LogLevel level) {
  switch (level) {
    case LogLevel::Debug:
      return spdlog::level::debug;
    case LogLevel::Info:
      return spdlog::level::info;
    case LogLevel::Warn:
      return spdlog::level::warn;
    case LogLevel::Error:
      break;
  }
  return spdlog::level::err;
}

/// Escape sequence (ECMA-48, SGR) for the name of a level.
std::string_view color_of(spdlog::level::level_enum level) {
  switch (level) {
    case spdlog::level::debug:
      return "\033[36m";
    case spdlog::level::info:
      return "\033[32m";
    case spdlog::level::warn:
      return "\033[33m\033[1m";
    default:
      return "\033[31m\033[1m";
  }
}

/// Standard error, in colour on a terminal.
class StandardError : public spdlog::sinks::base_sink<std::mutex> {
 public:
  uint64_t dropped() const { return writer_.dropped(); }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    constexpr std::string_view kPlain = "\033[m";
    spdlog::memory_buf_t formatted;
    formatter_->format(message, formatted);
    std::string line(formatted.data(), formatted.size());
    if (has_color_ && message.color_range_end > message.color_range_start) {
      line.insert(message.color_range_end, kPlain);
      line.insert(message.color_range_start, color_of(message.level));
    }
    writer_.write(line);
  }
  void flush_() override {}

 private:
  LineWriter writer_{STDERR_FILENO};
  const bool has_color_ =
      spdlog::details::os::in_terminal(stderr) && spdlog::details::os::is_color_terminal();
};

const std::shared_ptr<StandardError>& standard_error() {
  static const auto sink = std::make_shared<StandardError>();
  return sink;
}

std::atomic<LogFormat> format_of_lines{LogFormat::Text};

/// One line without control characters, inside the quotes of JSON (RFC 8259, section 7).
std::string in_quotes(const std::string& line) {
  std::string quoted;
  for (const char c : line) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted;
}

}  // namespace

bool init_log(const std::string& level, LogFormat format) {
  const auto parsed = spdlog::level::from_str(level == "warn" ? "warning" : level);
  if (parsed == spdlog::level::off && level != "off") return false;
  std::signal(SIGPIPE, SIG_IGN);
  auto logger = std::make_shared<spdlog::logger>("strandcast", standard_error());
  logger->set_level(parsed);
  format_of_lines = format;
  if (format == LogFormat::Json)
    logger->set_pattern("{\"time\":\"%Y-%m-%dT%H:%M:%S.%eZ\",\"level\":\"%l\",%v}",
                        spdlog::pattern_time_type::utc);
  else
    logger->set_pattern("%H:%M:%S.%e %^%l%$ %v");
  spdlog::set_default_logger(std::move(logger));
  return true;
}

bool is_logged(LogLevel level) {
  return spdlog::should_log(spdlog_level(level));
}

void log_line(LogLevel level, const char* tag, std::string_view message) {
  if (!is_logged(level)) return;
  // Before it is cut or quoted: half of a token is no less a secret.
  const std::string line = one_line(without_secrets(message), kMaxLogMessageChars);
  if (format_of_lines == LogFormat::Json)
    spdlog::log(spdlog_level(level), "\"tag\":\"{}\",\"message\":\"{}\"", tag, in_quotes(line));
  else
    spdlog::log(spdlog_level(level), "[{}] {}", tag, line);
}

uint64_t dropped_log_lines() {
  return standard_error()->dropped();
}

}  // namespace strandcast
