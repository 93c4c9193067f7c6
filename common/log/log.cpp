#include "common/log/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>

namespace strandcast {

bool init_log(const std::string& level) {
  const auto parsed = spdlog::level::from_str(level == "warn" ? "warning" : level);
  if (parsed == spdlog::level::off && level != "off") return false;
  auto logger = spdlog::get("strandcast");
  if (!logger) logger = spdlog::stderr_color_mt("strandcast");
  logger->set_level(parsed);
  logger->set_pattern("%H:%M:%S.%e %^%l%$ %v");
  spdlog::set_default_logger(logger);
  return true;
}

}  // namespace strandcast
