#include "client/app/feed.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "common/base/profile.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;

constexpr int64_t kSecondNs = 1'000'000'000;
constexpr int64_t kSkipBehindNs =
    kSecondNs / 4;                         // further behind than this: go on from now, do not send a burst
constexpr milliseconds kLongestSleep{50};  // so that a stop is noticed
constexpr milliseconds kFlushWait{250};    // less than a stop is given

/// Sleeps until `time_ns` of now_ns()'s clock in pieces; false when stopped.
bool sleep_until_ns(int64_t time_ns, const std::atomic<bool>& stop) {
  while (!stop) {
    const int64_t left_ns = time_ns - now_ns();
    if (left_ns <= 0) return true;
    const std::chrono::steady_clock::time_point end{std::chrono::nanoseconds(time_ns)};
    std::this_thread::sleep_until(std::min(end, std::chrono::steady_clock::now() + kLongestSleep));
  }
  return false;
}

class Feeder {
 public:
  Feeder(ViewerClient& client, const FeedPlan& plan) : client_(client), plan_(plan) {}

  Result<FeedProgress> run(const std::atomic<bool>& stop, const FeedListener& listener) {
    const auto period_ns = static_cast<int64_t>(static_cast<double>(kSecondNs) / plan_.rate_hz);
    const int64_t begin_ns = now_ns();
    int64_t next_report_ns = begin_ns + kSecondNs;
    for (int64_t index = 0;; ++index) {
      int64_t sample_ns = begin_ns + index * period_ns;
      if (const int64_t behind_ns = now_ns() - sample_ns; behind_ns > kSkipBehindNs) {
        const int64_t skipped = behind_ns / period_ns;
        progress_.skipped_samples += static_cast<uint64_t>(skipped);
        index += skipped;
        sample_ns += skipped * period_ns;
      }
      const double t_s = static_cast<double>(sample_ns - begin_ns) * 1e-9;
      progress_.motion_s += (t_s - progress_.elapsed_s) * plan_.speed * progress_.pace;
      progress_.elapsed_s = t_s;
      if (plan_.duration_s > 0.0 && t_s >= plan_.duration_s) break;
      if (plan_.motion_s > 0.0 && progress_.motion_s >= plan_.motion_s) break;
      if (!sleep_until_ns(sample_ns, stop)) break;
      const double lateness_ms = static_cast<double>(now_ns() - sample_ns) * 1e-6;
      progress_.worst_lateness_ms = std::max(progress_.worst_lateness_ms, lateness_ms);
      send_sample(sample_ns);
      RETURN_IF_ERROR(read_events());
      if (now_ns() < next_report_ns) continue;
      next_report_ns += kSecondNs;
      if (listener) listener(progress_);
    }
    flush();
    return std::move(progress_);
  }

 private:
  void send_sample(int64_t sample_ns) {
    if (plan_.motion) {
      MotionSamples message{{{sample_ns, plan_.motion(progress_.motion_s)}}, 1.0 - progress_.pace};
      if (plan_.joints) {
        message.joint_names = plan_.joint_names;
        const std::vector<glm::dvec3> places = plan_.joints(progress_.motion_s);
        message.samples.front().joint_m.assign(places.begin(), places.end());
      }
      count(client_.send(message), progress_.motion_samples);
    }
    if (plan_.wind) {
      const WindSamples message{{{sample_ns, plan_.wind(progress_.motion_s)}}};
      count(client_.send(message), progress_.wind_samples);
    }
  }

  void count(const Status& sent, uint64_t& counter) { ++(sent ? counter : progress_.unsent_samples); }

  Status read_events() {
    for (ClientEvent& event : client_.poll()) {
      if (const auto* closed = std::get_if<ClosedEvent>(&event)) return closed->error;
      if (auto* notice = std::get_if<Notice>(&event)) progress_.last_notice = std::move(notice->text);
      if (const auto* status = std::get_if<ServerStatus>(&event)) {
        progress_.rejected_samples = status->rejected_samples;
        if (!plan_.is_live) progress_.pace = follow_pace(progress_.pace, *status);
      }
    }
    return {};
  }

  void flush() {
    const int64_t end_ns = now_ns() + std::chrono::nanoseconds(kFlushWait).count();
    while (client_.queued_messages() > 0 && now_ns() < end_ns) std::this_thread::sleep_for(milliseconds(1));
  }

  ViewerClient& client_;
  const FeedPlan& plan_;
  FeedProgress progress_;
};

}  // namespace

double follow_pace(double present, const ServerStatus& status) {
  if (status.is_paused) return 0.0;
  const double wanted = status.realtime_factor >= kSteadyPace ? 1.0 : status.realtime_factor;
  const double next = 0.5 * (present + wanted);
  return next >= kSteadyPace ? 1.0 : next;
}

Result<FeedProgress> feed(ViewerClient& client, const FeedPlan& plan, const std::atomic<bool>& stop,
                          const FeedListener& listener) {
  return Feeder(client, plan).run(stop, listener);
}

}  // namespace strandcast
