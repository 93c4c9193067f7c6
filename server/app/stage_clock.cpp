#include "server/app/stage_clock.h"

#include <fcntl.h>
#include <sys/timex.h>
#include <unistd.h>

#include "common/base/text.h"
#include "common/base/units.h"

namespace strandcast {
namespace {

constexpr size_t kMaxClockChars = 100;
constexpr int64_t kNsPerDay = 86'400'000'000'000;

/// The clock behind a device's descriptor, as clock_gettime(2) knows it.
clockid_t clock_of(int descriptor) {
  constexpr clockid_t kDynamicClock = 3;
  return static_cast<clockid_t>(~static_cast<unsigned>(descriptor) << 3) | kDynamicClock;
}

}  // namespace

Result<StageClock> StageClock::open(const std::string& text) {
  StageClock clock;
  if (text == "local") return clock;
  clock.name_ = text;
  clock.is_local_ = false;
  if (text == "utc") return clock;
  if (text == "tai") {
    clock.id_ = CLOCK_TAI;
    timex state{};
    if (::adjtimex(&state) < 0 || state.tai == 0)
      return make_error(
          ErrorCode::NotFound,
          "this machine does not know how far TAI is ahead of UTC; ptp4l with phc2sys, or chrony "
          "with leapsectz, tells it");
    return clock;
  }
  const std::string shown = excerpt(text, kMaxClockChars);
  if (!text.starts_with('/'))
    return make_error(ErrorCode::BadInput, "there is no clock '{}'; there are local, utc, tai and /dev/ptpN",
                      shown);
  const int descriptor = ::open(text.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return make_error(ErrorCode::NotFound, "{} cannot be opened", shown);
  clock.device_ = std::shared_ptr<void>(nullptr, [descriptor](void*) { ::close(descriptor); });
  clock.id_ = clock_of(descriptor);
  timespec now{};
  if (::clock_gettime(clock.id_, &now) != 0)
    return make_error(ErrorCode::BadInput, "{} is no PTP device: it tells no time", shown);
  return clock;
}

int64_t StageClock::time_ns() const {
  timespec now{};
  // A device that was taken away stands still.
  if (::clock_gettime(id_, &now) != 0) return 0;
  return static_cast<int64_t>(now.tv_sec) * static_cast<int64_t>(kNsPerS) + now.tv_nsec;
}

Timecode StageClock::timecode_at(int64_t time_ns, const Timecode& count) const {
  if (is_local_) {
    const auto seconds = static_cast<std::time_t>(time_ns / static_cast<int64_t>(kNsPerS));
    std::tm parts{};
    ::localtime_r(&seconds, &parts);
    time_ns += static_cast<int64_t>(parts.tm_gmtoff) * static_cast<int64_t>(kNsPerS);
  }
  const int64_t of_day_ns = (time_ns % kNsPerDay + kNsPerDay) % kNsPerDay;
  return advanced({count.rate, count.is_drop}, static_cast<double>(of_day_ns) * kSPerNs * count.rate.hz());
}

}  // namespace strandcast
