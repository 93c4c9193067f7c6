#include "server/app/live_manager.h"

#include <algorithm>
#include <utility>

#include "common/base/profile.h"
#include "common/base/text.h"
#include "common/base/units.h"
#include "common/log/log.h"

namespace strandcast {
namespace {

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

bool is_same_place(const LivePort& a, const LivePort& b) {
  return a.protocol == b.protocol && a.host == b.host && a.port == b.port;
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
    if (input.scale != 1.0) line += fmt::format("; places times {:g}", input.scale);
    lines.push_back(std::move(line));
  }
  return lines;
}

LiveManager::LiveManager(std::vector<Target> targets, std::vector<Input> inputs)
    : targets_(std::move(targets)),
      inputs_(std::move(inputs)),
      lines_(RepeatLimits()),
      refusal_lines_(kRefusalLines),
      troubles_(inputs_.size()) {}

LiveManager::~LiveManager() {
  stop();
}

Result<std::unique_ptr<LiveManager>> LiveManager::open(std::vector<Target> targets,
                                                       const std::vector<AddressRange>& allowed) {
  std::vector<Input> inputs;
  std::vector<LivePort> ports;
  for (size_t head = 0; head < targets.size(); ++head) {
    const size_t first = inputs.size();
    for (size_t i = 0; i < targets[head].live.size(); ++i) {
      const LiveDesc& live = targets[head].live[i];
      ASSIGN_OR_RETURN(std::unique_ptr<LiveSource> source, LiveSource::make(live, i));
      Input input{std::move(source), kFirstLiveSourceId + i, head, ports.size()};
      const LivePort port = port_of(*input.source, i);
      // Of its own head none: that would be the same input twice, and the port is in use.
      for (size_t other = 0; other < first; ++other)
        if (is_same_place(ports[inputs[other].socket], port)) input.socket = inputs[other].socket;
      if (input.socket == ports.size()) ports.push_back(port);
      targets[head].inputs->set_delay(input.id, static_cast<int64_t>(live.delay_ms * kNsPerMs));
      inputs.push_back(std::move(input));
    }
  }
  std::unique_ptr<LiveManager> manager(new LiveManager(std::move(targets), std::move(inputs)));
  ASSIGN_OR_RETURN(manager->receiver_, LiveReceiver::open(ports, allowed, *manager));
  for (const Input& input : manager->inputs_) log_info("mocap", "{}", manager->name_of(input));
  if (!allowed.empty())
    log_warn("mocap",
             "more than this machine may send motion, and nothing says who it is: protocols of motion "
             "capture know no passwords");
  return manager;
}

void LiveManager::start() {
  receiver_->start();
}

void LiveManager::stop() {
  if (receiver_ != nullptr) receiver_->stop();
}

template <class Work>
void LiveManager::for_head(size_t head, Work work) const {
  for (const Input& input : inputs_)
    if (input.head == head) work(*input.source);
}

template <class Work>
void LiveManager::for_socket(size_t socket, Work work) const {
  for (const Input& input : inputs_)
    if (input.socket == socket) work(input);
}

/// All that hear a socket would ask its peer for the same.
LiveSource& LiveManager::first_of(size_t socket) const {
  const auto first = std::find_if(inputs_.begin(), inputs_.end(),
                                  [&](const Input& input) { return input.socket == socket; });
  return *first->source;
}

// ---- from any thread

std::vector<LiveInputStatus> LiveManager::status(size_t head) const {
  const std::lock_guard lock(mutex_);
  std::vector<LiveInputStatus> all;
  for_head(head, [&](LiveSource& source) { all.push_back(source.status(now_ns())); });
  return all;
}

std::vector<LiveDesc> LiveManager::live(size_t head) const {
  const std::lock_guard lock(mutex_);
  std::vector<LiveDesc> all;
  for_head(head, [&](LiveSource& source) { all.push_back(source.live()); });
  return all;
}

Notice LiveManager::choose_subject(const std::string& subject, size_t head) {
  bool is_seen = false;
  for_head(head, [&](LiveSource& source) { is_seen = is_seen || source.has_seen(subject); });
  // Of several inputs those that see it; where none does, all wait for it.
  for_head(head, [&](LiveSource& source) {
    if (subject.empty() || !is_seen || source.has_seen(subject)) source.choose_subject(subject);
  });
  if (subject.empty())
    return {false, "The head follows a subject that is called head, else the first one seen."};
  if (is_seen) return {false, fmt::format("The head follows {}.", subject)};
  std::string seen;
  for_head(head, [&](LiveSource& source) {
    const std::string more = source.status(now_ns()).subjects;
    if (!more.empty()) seen += (seen.empty() ? "" : ", ") + more;
  });
  return {false, fmt::format("Nobody called {} is seen: the head waits (seen: {}).", subject,
                             seen.empty() ? "nobody" : seen)};
}

Notice LiveManager::obey(const LiveCommand& command, size_t head) {
  const std::lock_guard lock(mutex_);
  if (command.action == LiveAction::ChooseSubject) return choose_subject(command.subject, head);
  if (command.action == LiveAction::Reset) {
    for_head(head, [](LiveSource& source) { source.reset_calibration(); });
    return {false, "The head is where its source says."};
  }
  std::string calibrated;
  for_head(head, [&](LiveSource& source) {
    if (source.calibrate(now_ns())) calibrated += (calibrated.empty() ? "" : ", ") + source.describe();
  });
  if (calibrated.empty()) return {true, "There is nothing to calibrate by: no live input sees the head now."};
  return {false, fmt::format("The head at rest is as it is seen now ({}).", calibrated)};
}

// ---- the receiver's thread

bool LiveManager::on_bytes(size_t socket, const std::string& sender, std::span<const std::byte> bytes,
                           int64_t arrival_ns) {
  const std::lock_guard lock(mutex_);
  bool is_of_use = false;
  for_socket(socket, [&](const Input& input) {
    is_of_use = input.source->take(sender, bytes, arrival_ns).ok() || is_of_use;
    pass_on(input, now_ns());
  });
  return is_of_use;
}

void LiveManager::on_refused(size_t socket, const std::string& sender, const std::string& remedy) {
  const std::lock_guard lock(mutex_);
  for_socket(socket, [](const Input& input) { input.source->refuse(); });
  const LogBudget::Verdict verdict = refusal_lines_.take(address_of(sender), now_ns());
  if (verdict.left_out > 0)
    log_warn("mocap", "{} lines about others that may not send were left out", verdict.left_out);
  if (verdict.is_written)
    log_warn("mocap", "{}: {} may not send: {}", first_of(socket).describe(), sender, remedy);
}

void LiveManager::on_connection(size_t socket) {
  const std::lock_guard lock(mutex_);
  for_socket(socket, [](const Input& input) { input.source->begin_connection(); });
  troubles_[socket].clear();
  log_info("mocap", "{}: connected", first_of(socket).describe());
}

void LiveManager::on_no_connection(size_t socket, const std::string& why) {
  const std::lock_guard lock(mutex_);
  // Tried every few seconds, told once.
  if (std::exchange(troubles_[socket], why) == why) return;
  const std::string what = first_of(socket).describe();
  write(what, {true,
               fmt::format("{}: {}; tried again every {:g} s", what, one_line(why, kMaxShownChars),
                           static_cast<double>(kLiveRetryMs) * 1e-3),
               LiveNoteKind::Connection});
}

std::vector<std::byte> LiveManager::greeting(size_t socket) {
  const std::lock_guard lock(mutex_);
  return first_of(socket).greeting();
}

std::vector<std::byte> LiveManager::request(size_t socket) {
  const std::lock_guard lock(mutex_);
  return first_of(socket).request();
}

bool LiveManager::on_tick(int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  bool is_active = false;
  for (const Input& input : inputs_) {
    pass_on(input, now_ns);
    is_active = is_active || input.source->is_active();
  }
  for (const RepeatBudget::Sum& sum : lines_.take_sums(now_ns))
    log_warn("mocap", "{} ({} more like it)", sum.newest, sum.count);
  return is_active;
}

/// What is due goes to the inputs, and to who listens to them.
void LiveManager::pass_on(const Input& input, int64_t now_ns) {
  const Target& target = targets_[input.head];
  const LiveSource::Due due = input.source->advance(now_ns);
  for (const MotionSamples& samples : due.motion) {
    target.inputs->push(input.id, samples, now_ns);
    if (target.listener.on_motion) target.listener.on_motion(input.id, samples, now_ns);
  }
  for (const WindSamples& samples : due.wind) {
    target.inputs->push(input.id, samples, now_ns);
    if (target.listener.on_wind) target.listener.on_wind(input.id, samples, now_ns);
  }
  if (due.recording && &first_of(input.socket) == input.source.get()) {
    if (target.listener.on_record)
      target.listener.on_record(*due.recording);
    else
      write(name_of(input),
            {true, fmt::format("{}: a sender wants to record: that needs --record-dir", name_of(input)),
             LiveNoteKind::Recording});
  }
  if (due.has_ended) target.inputs->remove_source(input.id);
  for (LiveNote& note : input.source->take_notes()) {
    if (!target.head.empty()) note.text = fmt::format("{}: {}", target.head, note.text);
    write(name_of(input), note);
  }
}

/// Of an input, for people, with the head that it moves where there are several.
std::string LiveManager::name_of(const Input& input) const {
  const std::string& head = targets_[input.head].head;
  return head.empty() ? input.source->describe() : fmt::format("{}: {}", head, input.source->describe());
}

void LiveManager::write(const std::string& name, const LiveNote& note) {
  if (!lines_.take(fmt::format("{} {}", static_cast<int>(note.kind), name), note.text)) return;
  if (note.is_warning)
    log_warn("mocap", "{}", note.text);
  else
    log_info("mocap", "{}", note.text);
}

}  // namespace strandcast
