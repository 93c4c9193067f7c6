#include "server/relay/uplinks.h"

#include <algorithm>
#include <type_traits>
#include <utility>
#include <variant>

#include "common/base/profile.h"
#include "common/base/thread_name.h"

namespace strandcast {
namespace {

CloseCode close_code_for(const Error& error) {
  if (error.code == ErrorCode::Unauthorized) return CloseCode::Unauthorized;
  if (error.code == ErrorCode::NotFound) return CloseCode::NotFound;
  return is_final(error, Standing::Newcomer) ? CloseCode::Refused : CloseCode::TryLater;
}

/// How often idle ones are looked for.
constexpr std::chrono::seconds kIdleLook{1};

/// Answers, and what was asked for; what everybody is told comes from elsewhere.
template <class Message>
constexpr bool is_for_one = std::is_same_v<Message, Notice> || std::is_same_v<Message, ParameterList> ||
                            std::is_same_v<Message, SceneText> || std::is_same_v<Message, SessionList> ||
                            std::is_same_v<Message, StateTimes> || std::is_same_v<Message, FrameQuality>;

}  // namespace

void Uplinks::start(NetServer& net) {
  net_ = &net;
  thread_ = std::thread([this] { run(); });
}

void Uplinks::stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    for (auto& [session, uplink] : uplinks_) end(uplink);
    uplinks_.clear();
    for (auto& [head, enquiry] : enquiries_) {
      if (enquiry.link == nullptr) continue;
      enquiry.link->begin_stop();
      ended_.push_back(std::move(enquiry.link));
    }
    enquiries_.clear();
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

/// Waits for those that end, and ends those that are idle.
void Uplinks::run() {
  name_thread("uplinks");
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait_for(lock, kIdleLook, [this] { return is_stopping_ || !ended_.empty(); });
    end_idle(now_ns());
    auto ended = std::exchange(ended_, {});
    if (ended.empty() && is_stopping_) return;
    lock.unlock();
    ended.clear();
    lock.lock();
  }
}

void Uplinks::end_idle(int64_t time_ns) {
  for (auto& [session, uplink] : uplinks_) {
    if (uplink.link == nullptr || uplink.is_kept || time_ns - uplink.said_ns < idle_ns_) continue;
    end(uplink);
    uplink.ended_ns = 0;
  }
}

void Uplinks::end(Uplink& uplink) {
  if (uplink.link == nullptr) return;
  uplink.link->begin_stop();
  ended_.push_back(std::move(uplink.link));
  uplink.ended_ns = now_ns();
  changed_.notify_all();
}

template <class IsOne>
size_t Uplinks::count_open(IsOne is_one) const {
  return static_cast<size_t>(std::count_if(uplinks_.begin(), uplinks_.end(), [&](const auto& entry) {
    return entry.second.link != nullptr && is_one(entry.second);
  }));
}

/// Those who only watch leave places to others, and one address leaves some to other addresses.
std::optional<Error> Uplinks::why_full(const Speaker& speaker) const {
  const bool is_full = count_open([](const Uplink&) { return true; }) >= kMaxUplinks ||
                       (speaker.hello.role == Role::Viewer &&
                        count_open([](const Uplink& one) { return one.is_watcher; }) >= kMaxWatchersUplinks);
  if (is_full)
    return make_error(ErrorCode::Unavailable,
                      "{} of this relay say something or get pictures already: try again later",
                      speaker.hello.role == Role::Viewer ? fmt::format("{} viewers", kMaxWatchersUplinks)
                                                         : fmt::format("{} sessions", kMaxUplinks));
  const bool is_watcher = speaker.hello.role == Role::Viewer;
  const size_t of_address = count_open(
      [&](const Uplink& one) { return one.address == speaker.address && one.is_watcher == is_watcher; });
  if (of_address < kMaxUplinksPerAddress) return std::nullopt;
  return make_error(ErrorCode::Unavailable,
                    "{} sessions of this address say something or get pictures already: try again later",
                    kMaxUplinksPerAddress);
}

/// Returns the session's link, opened where there is none; null while no new one may be tried.
UpstreamLink* Uplinks::find_or_open(const Speaker& speaker, const Hello& hello, size_t head) {
  if (is_stopping_) return nullptr;
  const SessionId session = speaker.session;
  Uplink& uplink = uplinks_.try_emplace(session).first->second;
  uplink.said_ns = now_ns();
  if (uplink.link != nullptr) return uplink.link.get();
  if (uplink.ended_ns != 0 && now_ns() - uplink.ended_ns < kSpeakAgainNs) return nullptr;
  const bool has_pictures = !hello.gets_no_stream;
  if (const std::optional<Error> error = why_full(speaker)) {
    uplink.ended_ns = now_ns();
    tell(session, *error, has_pictures);
    return nullptr;
  }
  uplink.address = speaker.address;
  uplink.is_watcher = speaker.hello.role == Role::Viewer;
  uplink.is_kept = has_pictures;
  UpstreamLink::Hooks hooks;
  hooks.on_welcome = [](const Welcome&) { return Status(); };
  hooks.on_event = [this, session, head, has_pictures](ClientEvent event) {
    // When which sample could be seen in pictures stands in the status of their session.
    if (const auto* status = std::get_if<ServerStatus>(&event); status != nullptr && has_pictures)
      net_->send(session, *status);
    on_event(session, head, std::move(event));
  };
  hooks.on_lost = [this, session, has_pictures](const Error& error) {
    return on_lost(session, error, has_pictures);
  };
  uplink.link = std::make_unique<UpstreamLink>(client_config_for(config_, hello), std::move(hooks));
  return uplink.link.get();
}

void Uplinks::say(const Speaker& speaker, const ClientMessage& message) {
  const auto* request = std::get_if<ParameterRequest>(&message);
  if (request != nullptr && !request->is_watching) return ask(speaker, *request);
  const Hello& viewer = speaker.hello;
  Hello hello;
  hello.role = viewer.role;
  hello.name = viewer.name;
  hello.token = viewer.token;
  hello.head = viewer.head;
  hello.gets_no_stream = true;
  const std::lock_guard lock(mutex_);
  UpstreamLink* link = find_or_open(speaker, hello, 0);
  if (link == nullptr) return;
  link->send(message);
  // What is watched comes without another word.
  if (request != nullptr || std::holds_alternative<StateTimesRequest>(message))
    uplinks_[speaker.session].is_kept = true;
}

void Uplinks::open_pictures(const Speaker& speaker, size_t head) {
  Hello hello = speaker.hello;
  hello.acknowledges = false;
  const std::lock_guard lock(mutex_);
  (void)find_or_open(speaker, hello, head);
}

// ---- questions ----

/// Anybody whom the relay lets in may ask: the relay asks in its own name, and answers come in order.
void Uplinks::ask(const Speaker& speaker, const ParameterRequest& request) {
  const std::lock_guard lock(mutex_);
  if (is_stopping_) return;
  Enquiry& enquiry = enquiries_[speaker.hello.head];
  const auto waiting = std::count(enquiry.asked_by.begin(), enquiry.asked_by.end(), speaker.session);
  if (static_cast<size_t>(waiting) >= kMaxQuestionsOfOne)
    return net_->send(speaker.session,
                      Notice{true, "Too many requests for parameters: this one was left out."});
  enquiry.asked_by.push_back(speaker.session);
  open_enquiry(speaker.hello.head, enquiry).send(request);
}

UpstreamLink& Uplinks::open_enquiry(const std::string& head, Enquiry& enquiry) {
  if (enquiry.link != nullptr) return *enquiry.link;
  Hello hello;
  hello.name = "relay";
  hello.token = config_.token;
  hello.head = head;
  hello.gets_no_stream = true;
  UpstreamLink::Hooks hooks;
  hooks.on_welcome = [](const Welcome&) { return Status(); };
  hooks.on_event = [this, head](ClientEvent event) { on_answer(head, std::move(event)); };
  hooks.on_lost = [this, head](const Error& error) { return on_enquiry_lost(head, error); };
  enquiry.link = std::make_unique<UpstreamLink>(client_config_for(config_, hello), std::move(hooks));
  return *enquiry.link;
}

/// A list, or an error instead of it; what everybody is told comes from elsewhere.
void Uplinks::on_answer(const std::string& head, ClientEvent event) {
  auto* list = std::get_if<ParameterList>(&event);
  auto* notice = std::get_if<Notice>(&event);
  if (list == nullptr && (notice == nullptr || !notice->is_error)) return;
  const std::lock_guard lock(mutex_);
  std::deque<SessionId>& asked_by = enquiries_[head].asked_by;
  if (asked_by.empty()) return;
  const SessionId session = asked_by.front();
  asked_by.pop_front();
  if (list != nullptr)
    net_->send(session, std::move(*list));
  else
    net_->send(session, std::move(*notice));
}

/// The next question opens it again.
bool Uplinks::on_enquiry_lost(const std::string& head, const Error& error) {
  const std::lock_guard lock(mutex_);
  Enquiry& enquiry = enquiries_[head];
  if (enquiry.link != nullptr) {
    enquiry.link->begin_stop();
    ended_.push_back(std::move(enquiry.link));
  }
  changed_.notify_all();
  for (const SessionId session : std::exchange(enquiry.asked_by, {}))
    net_->send(session, Notice{true, error.to_string()});
  return false;
}

// ---- how they end ----

void Uplinks::request_picture(SessionId session) {
  const std::lock_guard lock(mutex_);
  const auto found = uplinks_.find(session);
  if (found != uplinks_.end() && found->second.link != nullptr) found->second.link->request_keyframe();
}

void Uplinks::leave(SessionId session) {
  const std::lock_guard lock(mutex_);
  const auto found = uplinks_.find(session);
  if (found == uplinks_.end()) return;
  end(found->second);
  uplinks_.erase(found);
}

size_t Uplinks::count() const {
  const std::lock_guard lock(mutex_);
  const auto enquiries = std::count_if(enquiries_.begin(), enquiries_.end(),
                                       [](const auto& entry) { return entry.second.link != nullptr; });
  return count_open([](const Uplink&) { return true; }) + static_cast<size_t>(enquiries);
}

/// Who came for pictures has nothing else to stay for.
void Uplinks::tell(SessionId session, const Error& error, bool has_pictures) {
  if (has_pictures)
    net_->close(session, close_code_for(error), error.to_string());
  else
    net_->send(session, Notice{true, error.to_string()});
}

void Uplinks::on_event(SessionId session, size_t head, ClientEvent event) {
  if (auto* media = std::get_if<MediaEvent>(&event)) {
    const Opcode opcode = media->header.opcode;
    if (is_chained_picture(opcode) || opcode == Opcode::JpegFrame)
      net_->publish_picture(static_cast<PictureClass>(session), make_picture(frame_of(std::move(*media))),
                            head);
    return;
  }
  std::visit(
      [&](auto& part) {
        if constexpr (is_for_one<std::decay_t<decltype(part)>>) net_->send(session, std::move(part));
      },
      event);
}

bool Uplinks::on_lost(SessionId session, const Error& error, bool has_pictures) {
  const std::lock_guard lock(mutex_);
  const auto found = uplinks_.find(session);
  if (found == uplinks_.end()) return false;
  end(found->second);
  tell(session, error, has_pictures);
  return false;
}

}  // namespace strandcast
