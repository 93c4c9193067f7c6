#include "client/app/feed.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/wire/sample_limits.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;
// Further behind than this: go on from now. A burst would not reach the head, or move it too fast.
constexpr int64_t kSkipBehindNs = kSInNs / 20;
constexpr milliseconds kLongestSleep{50};  // so that a stop is noticed
constexpr milliseconds kFlushWait{250};    // less than a stop is given
// What a simulation that begins may be late by is no slow motion, nor is a pace of this and more.
constexpr double kLeastMissingS = 0.5;
constexpr double kSlowMotion = 0.95;

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

/// Plays a plan; who is fed is told by `Way`: send(), read_events() and flush().
template <class Way>
class Feeder {
 public:
  Feeder(Way& way, const FeedPlan& plan) : way_(way), plan_(plan) {}

  Result<FeedProgress> run(const std::atomic<bool>& stop, const FeedListener& listener) {
    const auto period_ns = static_cast<int64_t>(static_cast<double>(kSInNs) / plan_.rate_hz);
    const int64_t begin_ns = now_ns();
    int64_t next_report_ns = begin_ns + kSInNs;
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
      // The motion ends where it ends, not at the sample before.
      const bool is_end = plan_.motion_s > 0.0 && progress_.motion_s >= plan_.motion_s;
      if (is_end) progress_.motion_s = plan_.motion_s;
      if (!sleep_until_ns(sample_ns, stop)) break;
      const double lateness_ms = static_cast<double>(now_ns() - sample_ns) * 1e-6;
      progress_.worst_lateness_ms = std::max(progress_.worst_lateness_ms, lateness_ms);
      way_.send(plan_, sample_ns, progress_);
      RETURN_IF_ERROR(way_.read_events(plan_, progress_));
      if (is_end) break;
      if (now_ns() < next_report_ns) continue;
      next_report_ns += kSInNs;
      if (listener) listener(progress_);
    }
    way_.flush();
    return std::move(progress_);
  }

 private:
  Way& way_;
  const FeedPlan& plan_;
  FeedProgress progress_;
};

void count(bool is_sent, uint64_t& counter, FeedProgress& progress) {
  ++(is_sent ? counter : progress.unsent_samples);
}

/// Sends to a server, as a source of its own for each head.
class SessionWay {
 public:
  explicit SessionWay(std::span<const std::unique_ptr<SteadyClient>> heads)
      : heads_(heads), told_(heads.size()) {}

  void send(const FeedPlan& plan, int64_t sample_ns, FeedProgress& progress) {
    const auto timecode = plan.timecode ? plan.timecode(progress.motion_s) : std::nullopt;
    if (!plan.motion && timecode)
      for (const auto& head : heads_) send_to(*head, MotionSamples{{}, 0.0, {}, timecode});
    if (plan.motion) {
      MotionSamples message{{{sample_ns, plan.motion(progress.motion_s)}}, 1.0 - progress.pace};
      if (plan.joints) {
        message.joint_names = plan.joint_names;
        const std::vector<glm::dvec3> places = plan.joints(progress.motion_s);
        message.samples.front().joint_m.assign(places.begin(), places.end());
      }
      message.timecode = timecode;
      for (size_t i = 0; i < heads_.size(); ++i) {
        const bool is_sent = send_to(*heads_[i], message);
        count(is_sent, progress.motion_samples, progress);
        if (is_sent) judge(message, progress);
        if (is_sent && told_[i].sent_ns == 0) told_[i].sent_ns = now_ns();
      }
    }
    if (plan.wind) {
      const WindSamples message{{{sample_ns, plan.wind(progress.motion_s)}}};
      for (const auto& head : heads_) count(send_to(*head, message), progress.wind_samples, progress);
    }
  }

  Status read_events(const FeedPlan& plan, FeedProgress& progress) {
    for (size_t i = 0; i < heads_.size(); ++i) RETURN_IF_ERROR(read_events_of(i, plan, progress));
    progress.rejected_samples = 0;
    progress.pace = 1.0;
    progress.is_heard = true;
    progress.reconnects = 0;
    progress.gone_s = 0.0;
    for (size_t i = 0; i < heads_.size(); ++i) {
      const Told& told = told_[i];
      progress.rejected_samples += told.rejected_samples;
      if (told.rejected_before && told.rejected_samples > *told.rejected_before)
        progress.refused_samples =
            std::max(progress.refused_samples, told.rejected_samples - *told.rejected_before);
      progress.pace = std::min(progress.pace, told.pace);
      progress.is_heard = progress.is_heard && told.is_heard;
      progress.reconnects += heads_[i]->policy().reconnects();
      progress.outage_s = std::max(progress.outage_s, heads_[i]->policy().outage_s(now_ns()));
      progress.gone_s = std::max(progress.gone_s, heads_[i]->policy().running_outage_s(now_ns()));
    }
    return {};
  }

  void flush() {
    const int64_t end_ns = now_ns() + std::chrono::nanoseconds(kFlushWait).count();
    for (const auto& head : heads_)
      while (head->client() != nullptr && head->client()->queued_messages() > 0 && now_ns() < end_ns)
        std::this_thread::sleep_for(milliseconds(1));
  }

 private:
  /// Counts what the server leaves out, by its own limits.
  static void judge(const MotionSamples& message, FeedProgress& progress) {
    std::string why = refusal_of(message.samples.front(), message.joint_names.size());
    if (why.empty()) return;
    ++progress.refused_samples;
    if (progress.refusal.empty()) progress.refusal = std::move(why) + ": is its unit right (--unit)?";
  }

  /// What the server said last of a head.
  struct Told {
    double pace = 1.0;
    uint64_t rejected_samples = 0;
    std::optional<uint64_t> rejected_before;  // this feed was told that its samples are left out
    int64_t sent_ns = 0;                      // the first sample of motion of this connection; 0: none yet
    uint64_t tick = 0;                        // of the first status after that
    bool is_heard = true;
    bool is_away = false;
  };

  static bool send_to(SteadyClient& head, const ClientMessage& message) {
    return head.client() != nullptr && head.client()->send(message).ok();
  }

  Status read_events_of(size_t index, const FeedPlan& plan, FeedProgress& progress) {
    Told& told = told_[index];
    SteadyClient& head = *heads_[index];
    RETURN_IF_ERROR(head.pump(milliseconds(0), [&](ClientEvent& event) {
      if (auto* notice = std::get_if<Notice>(&event)) {
        if (progress.refusal.empty() && notice->text.starts_with(kRefusedSamples)) {
          progress.refusal = notice->text.substr(std::string_view(kRefusedSamples).size());
          told.rejected_before = told.rejected_samples;
        }
        progress.last_notice = std::move(notice->text);
      }
      if (const auto* status = std::get_if<ServerStatus>(&event)) {
        told.rejected_samples = status->rejected_samples;
        if (!plan.is_live) told.pace = follow_pace(told.pace, *status);
        listen(told, *status, progress.last_notice);
      }
    }));
    const bool is_away = head.client() == nullptr;
    if (is_away) told.sent_ns = 0;
    if (std::exchange(told.is_away, is_away) != is_away && !plan.is_live) told.pace = is_away ? 0.0 : 1.0;
    return {};
  }

  /// Whether steps are taken with what was sent.
  static void listen(Told& told, const ServerStatus& status, const std::string& last_notice) {
    if (told.sent_ns == 0) return;
    if (told.tick == 0 || status.tick < told.tick) told.tick = status.tick;
    if (!status.is_motion_stale) {
      told.is_heard = true;
      return;
    }
    const bool is_late = now_ns() - told.sent_ns >= std::chrono::nanoseconds(kUnheardTime).count();
    const bool goes_on = !status.is_paused && status.tick > told.tick;
    if (is_late && goes_on && std::exchange(told.is_heard, false))
      log_warn("net", "not heard: no head motion arrives at the server{}",
               last_notice.empty() ? std::string() : ", which says: " + last_notice);
  }

  std::span<const std::unique_ptr<SteadyClient>> heads_;
  std::vector<Told> told_;
};

/// Sends to receivers that never answer.
class MomentWay {
 public:
  explicit MomentWay(const SendMoment& send) : send_(send) {}

  void send(const FeedPlan& plan, int64_t, FeedProgress& progress) {
    MocapMoment moment;
    moment.time_s = progress.elapsed_s;
    if (plan.motion) moment.world_from_head = plan.motion(progress.motion_s);
    if (plan.wind) moment.wind_mps = plan.wind(progress.motion_s);
    if (plan.timecode) moment.timecode = plan.timecode(progress.motion_s);
    count(send_(std::move(moment)), progress.motion_samples, progress);
  }
  Status read_events(const FeedPlan&, FeedProgress&) { return {}; }
  void flush() {}

 private:
  const SendMoment& send_;
};

}  // namespace

Result<std::vector<std::unique_ptr<SteadyClient>>> connect_heads(ClientConfig config,
                                                                 const std::atomic<bool>& stop,
                                                                 milliseconds limit) {
  std::vector<std::unique_ptr<SteadyClient>> heads;
  heads.push_back(std::make_unique<SteadyClient>(config));
  RETURN_IF_ERROR(heads.front()->await_welcome(stop, limit));
  if (!config.hello.head.empty()) return heads;
  const std::vector<std::string> names = heads.front()->welcome().heads;
  for (size_t i = 1; i < names.size(); ++i) {
    config.hello.head = names[i];
    heads.push_back(std::make_unique<SteadyClient>(config));
    RETURN_IF_ERROR(heads.back()->await_welcome(stop, limit));
  }
  return heads;
}

double follow_pace(double present, const ServerStatus& status) {
  if (status.is_paused) return 0.0;
  const double wanted = status.realtime_factor >= kSteadyPace ? 1.0 : status.realtime_factor;
  const double next = 0.5 * (present + wanted);
  return next >= kSteadyPace ? 1.0 : next;
}

Result<FeedProgress> feed(std::span<const std::unique_ptr<SteadyClient>> heads, const FeedPlan& plan,
                          const std::atomic<bool>& stop, const FeedListener& listener) {
  SessionWay way(heads);
  return Feeder(way, plan).run(stop, listener);
}

std::string slow_motion_sentence(const FeedProgress& done, double speed) {
  const double there_s = std::max(done.elapsed_s - done.outage_s, 0.0) * speed;
  const double missing_s = there_s - done.motion_s;
  if (missing_s <= (1.0 - kSlowMotion) * there_s || missing_s <= kLeastMissingS) return {};
  return fmt::format(
      "slow motion: {:.1f} s of the motion in {:.1f} s, as slowly as the simulation (--live feeds in real "
      "time)",
      done.motion_s, done.elapsed_s);
}

std::string refusal_sentence(const FeedProgress& done) {
  constexpr uint64_t kMostShare = 10;  // one in so many
  const uint64_t sent = done.motion_samples + done.wind_samples;
  if (done.refused_samples * kMostShare <= sent) return {};
  return fmt::format("{} of {} samples were left out by the server: {}", std::min(done.refused_samples, sent),
                     sent, done.refusal);
}

std::string gone_sentence(const FeedProgress& done) {
  if (done.gone_s > 0.0)
    return fmt::format(
        "the server was gone from {:.1f} s on, for {:.1f} s to the end: {} samples were not sent",
        std::max(done.elapsed_s - done.gone_s, 0.0), done.gone_s, done.unsent_samples);
  if (done.outage_s == 0.0) return {};
  return fmt::format("the server was away for {:.1f} s, and came back: {} samples were not sent",
                     done.outage_s, done.unsent_samples);
}

FeedProgress feed_moments(const SendMoment& send, const FeedPlan& plan, const std::atomic<bool>& stop,
                          const FeedListener& listener) {
  MomentWay way(send);
  return Feeder(way, plan).run(stop, listener).value();
}

}  // namespace strandcast
