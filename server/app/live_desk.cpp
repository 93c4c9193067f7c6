#include "server/app/live_desk.h"

#include <algorithm>
#include <utility>

#include "common/base/profile.h"
#include "common/base/text.h"
#include "common/log/log.h"

namespace strandcast {
namespace {

constexpr LogLimits kLiveLines{20, 120, 60'000'000'000};
constexpr LogLimits kRefusalLines{1, 30, 60'000'000'000};
constexpr size_t kMaxShownChars = 100;

LivePort port_of(const LiveSource& source, size_t index) {
  const LiveProtocol& protocol = source.protocol();
  LivePort port;
  port.field = fmt::format("live.{}", index);
  port.protocol = protocol.name;
  port.is_connection = protocol.transport == LiveTransport::Tcp;
  port.host = source.live().host;
  port.group = protocol.multicast_group;
  port.port = source.port();
  port.request_port = protocol.request_port;
  return port;
}

/// Of a sender, its address: what lines are counted by.
std::string address_of(const std::string& sender) {
  return sender.substr(0, sender.rfind(':'));
}

}  // namespace

Status check_live(const std::vector<LiveDesc>& live) {
  for (size_t i = 0; i < live.size(); ++i) {
    const auto source = LiveSource::make(live[i], i);
    if (!source) return source.error();
  }
  return {};
}

Result<std::vector<std::string>> explain_live(const std::vector<LiveDesc>& live,
                                              const std::vector<AddressRange>& allowed) {
  std::vector<std::string> lines;
  for (size_t i = 0; i < live.size(); ++i) {
    const LiveDesc& input = live[i];
    ASSIGN_OR_RETURN(const std::unique_ptr<LiveSource> source, LiveSource::make(input, i));
    const std::vector<const char*>& orders = source->protocol().axis_orders;
    std::string line = source->describe();
    line += !input.host.empty() ? "; it alone is heard"
            : allowed.empty()   ? "; this machine alone may send"
                                : "; this machine and those of --mocap-allow may send";
    line += input.subject.empty() ? "; the head follows one that is called head, else the first one seen"
                                  : fmt::format("; the head follows {}", input.subject);
    if (!orders.empty()) line += fmt::format("; axes {}", input.axes.empty() ? orders.front() : input.axes);
    if (input.delay_ms > 0.0) line += fmt::format("; {:g} ms later", input.delay_ms);
    if (input.turns_only) line += "; it turns and does not move";
    if (input.takes_zero_positions) line += "; a bone at 0 is there";
    lines.push_back(std::move(line));
  }
  return lines;
}

LiveDesk::LiveDesk(Sources sources, InputHub& inputs, Listener listener)
    : sources_(std::move(sources)),
      inputs_(inputs),
      listener_(std::move(listener)),
      lines_(kLiveLines),
      refusal_lines_(kRefusalLines),
      troubles_(sources_.size()) {}

LiveDesk::~LiveDesk() {
  stop();
}

Result<std::unique_ptr<LiveDesk>> LiveDesk::open(const std::vector<LiveDesc>& live,
                                                 const std::vector<AddressRange>& allowed, InputHub& inputs,
                                                 Listener listener) {
  Sources sources;
  std::vector<LivePort> ports;
  for (size_t i = 0; i < live.size(); ++i) {
    ASSIGN_OR_RETURN(std::unique_ptr<LiveSource> source, LiveSource::make(live[i], i));
    ports.push_back(port_of(*source, i));
    constexpr double kNsPerMs = 1e6;
    inputs.set_delay(kFirstLiveSourceId + i, static_cast<int64_t>(live[i].delay_ms * kNsPerMs));
    sources.push_back(std::move(source));
  }
  std::unique_ptr<LiveDesk> desk(new LiveDesk(std::move(sources), inputs, std::move(listener)));
  ASSIGN_OR_RETURN(desk->receiver_, LiveReceiver::open(ports, allowed, *desk));
  for (const auto& source : desk->sources_) log_info("mocap", "{}", source->describe());
  if (!allowed.empty())
    log_warn("mocap",
             "more than this machine may send motion, and nothing says who it is: protocols of motion "
             "capture know no passwords");
  return desk;
}

void LiveDesk::start() {
  receiver_->start();
}

void LiveDesk::stop() {
  if (receiver_ != nullptr) receiver_->stop();
}

// ---- from any thread

std::vector<LiveInputStatus> LiveDesk::status() const {
  const std::lock_guard lock(mutex_);
  std::vector<LiveInputStatus> all;
  for (const auto& source : sources_) all.push_back(source->status(now_ns()));
  return all;
}

std::vector<LiveDesc> LiveDesk::live() const {
  const std::lock_guard lock(mutex_);
  std::vector<LiveDesc> all;
  for (const auto& source : sources_) all.push_back(source->live());
  return all;
}

Notice LiveDesk::choose_subject(const std::string& subject) {
  bool is_seen = false;
  for (const auto& source : sources_) is_seen = is_seen || source->has_seen(subject);
  // Of several inputs those that see it; where none does, all wait for it.
  for (const auto& source : sources_)
    if (subject.empty() || !is_seen || source->has_seen(subject)) source->choose_subject(subject);
  if (subject.empty())
    return {false, "The head follows a subject that is called head, else the first one seen."};
  if (is_seen) return {false, fmt::format("The head follows {}.", subject)};
  std::string seen;
  for (const auto& source : sources_) {
    const std::string more = source->status(now_ns()).subjects;
    if (!more.empty()) seen += (seen.empty() ? "" : ", ") + more;
  }
  return {false, fmt::format("Nobody called {} is seen: the head waits (seen: {}).", subject,
                             seen.empty() ? "nobody" : seen)};
}

Notice LiveDesk::obey(const LiveCommand& command) {
  const std::lock_guard lock(mutex_);
  if (command.action == LiveAction::ChooseSubject) return choose_subject(command.subject);
  if (command.action == LiveAction::Reset) {
    for (const auto& source : sources_) source->reset_calibration();
    return {false, "The head is where its source says."};
  }
  std::string calibrated;
  for (const auto& source : sources_)
    if (source->calibrate(now_ns())) calibrated += (calibrated.empty() ? "" : ", ") + source->describe();
  if (calibrated.empty()) return {true, "There is nothing to calibrate by: no live input sees the head now."};
  return {false, fmt::format("The head at rest is as it is seen now ({}).", calibrated)};
}

// ---- the receiver's thread

bool LiveDesk::on_bytes(size_t input, const std::string& sender, std::span<const std::byte> bytes,
                        int64_t arrival_ns) {
  const std::lock_guard lock(mutex_);
  const Status taken = sources_[input]->take(sender, bytes, arrival_ns);
  pass_on(input, now_ns());
  return taken.ok();
}

void LiveDesk::on_refused(size_t input, const std::string& sender, const std::string& remedy) {
  const std::lock_guard lock(mutex_);
  LiveSource& source = *sources_[input];
  source.refuse();
  write(refusal_lines_, address_of(sender),
        {true, fmt::format("{}: {} may not send: {}", source.describe(), sender, remedy)}, now_ns());
}

void LiveDesk::on_connection(size_t input) {
  const std::lock_guard lock(mutex_);
  sources_[input]->begin_connection();
  troubles_[input].clear();
  log_info("mocap", "{}: connected", sources_[input]->describe());
}

void LiveDesk::on_no_connection(size_t input, const std::string& why) {
  const std::lock_guard lock(mutex_);
  // Tried every few seconds, told once.
  if (std::exchange(troubles_[input], why) == why) return;
  write(lines_, sources_[input]->describe(),
        {true, fmt::format("{}: {}; tried again every {:g} s", sources_[input]->describe(),
                           one_line(why, kMaxShownChars), static_cast<double>(kLiveRetryMs) * 1e-3)},
        now_ns());
}

std::vector<std::byte> LiveDesk::greeting(size_t input) {
  const std::lock_guard lock(mutex_);
  return sources_[input]->greeting();
}

std::vector<std::byte> LiveDesk::request(size_t input) {
  const std::lock_guard lock(mutex_);
  return sources_[input]->request();
}

bool LiveDesk::on_tick(int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  bool is_active = false;
  for (size_t i = 0; i < sources_.size(); ++i) {
    pass_on(i, now_ns);
    is_active = is_active || sources_[i]->is_active();
  }
  return is_active;
}

/// What is due goes to the inputs, and to who listens to them.
void LiveDesk::pass_on(size_t input, int64_t now_ns) {
  LiveSource& source = *sources_[input];
  const uint64_t id = kFirstLiveSourceId + input;
  const LiveSource::Due due = source.advance(now_ns);
  for (const MotionSamples& samples : due.motion) {
    inputs_.push(id, samples, now_ns);
    if (listener_.on_motion) listener_.on_motion(id, samples, now_ns);
  }
  for (const WindSamples& samples : due.wind) {
    inputs_.push(id, samples, now_ns);
    if (listener_.on_wind) listener_.on_wind(id, samples, now_ns);
  }
  if (due.has_ended) inputs_.remove_source(id);
  write_notes(source, now_ns);
}

void LiveDesk::write_notes(LiveSource& source, int64_t now_ns) {
  for (const LiveNote& note : source.take_notes()) write(lines_, source.describe(), note, now_ns);
}

void LiveDesk::write(LogBudget& budget, const std::string& key, const LiveNote& note, int64_t now_ns) {
  const LogBudget::Verdict verdict = budget.take(key, now_ns);
  if (verdict.left_out > 0) log_warn("mocap", "{} lines were left out", verdict.left_out);
  if (!verdict.is_written) return;
  if (note.is_warning)
    log_warn("mocap", "{}", note.text);
  else
    log_info("mocap", "{}", note.text);
}

}  // namespace strandcast
