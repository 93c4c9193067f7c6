#include "server/app/process_metrics.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <vector>

#include "common/base/units.h"

namespace strandcast {
namespace {

std::string metric(const char* name, const char* type, const char* help, double value) {
  return fmt::format("# HELP {0} {1}\n# TYPE {0} {2}\n{0} {3}\n", name, help, type, value);
}

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * kSPerUs;
}

/// Fields of /proc/self/stat from the third on (proc(5)); the second, the name, may hold anything.
std::vector<std::string> stat_fields() {
  std::ifstream file("/proc/self/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  const size_t end = text.rfind(')');
  if (end == std::string::npos) return {};
  std::istringstream words(text.substr(end + 1));
  return {std::istream_iterator<std::string>(words), {}};
}

/// Since 1970; 0 = unknown.
double start_time_s(const std::string& ticks_since_boot) {
  std::ifstream file("/proc/stat");
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("btime ")) continue;
    const double boot_s = std::strtod(line.c_str() + 6, nullptr);
    return boot_s +
           std::strtod(ticks_since_boot.c_str(), nullptr) / static_cast<double>(sysconf(_SC_CLK_TCK));
  }
  return 0.0;
}

}  // namespace

std::string format_process_metrics() {
  std::string text;
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0)
    text += metric("process_cpu_seconds_total", "counter", "Time of the processors, by all threads.",
                   seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime));
  // Places in stat_fields() of num_threads, starttime, vsize and rss.
  constexpr size_t kThreads = 17, kStart = 19, kVirtual = 20, kResident = 21;
  if (const std::vector<std::string> fields = stat_fields(); fields.size() > kResident) {
    const auto number = [&](size_t place) { return std::strtod(fields[place].c_str(), nullptr); };
    text += metric("process_threads", "gauge", "Threads.", number(kThreads));
    text += metric("process_virtual_memory_bytes", "gauge", "Address space.", number(kVirtual));
    text += metric("process_resident_memory_bytes", "gauge", "Memory in use.",
                   number(kResident) * static_cast<double>(sysconf(_SC_PAGESIZE)));
    if (const double start_s = start_time_s(fields[kStart]); start_s > 0.0)
      text += metric("process_start_time_seconds", "gauge", "When it was started, since 1970.", start_s);
  }
  std::error_code failure;
  const std::filesystem::directory_iterator files("/proc/self/fd", failure);
  if (!failure)
    text += metric("process_open_fds", "gauge", "Open files, sockets among them.",
                   static_cast<double>(std::distance(begin(files), end(files))));
  return text;
}

}  // namespace strandcast
