#include "server/relay/voices.h"

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

/// Answers, and what was asked for; what everybody is told comes from elsewhere.
template <class Message>
constexpr bool is_for_one = std::is_same_v<Message, Notice> || std::is_same_v<Message, ParameterList> ||
                            std::is_same_v<Message, SceneText> || std::is_same_v<Message, SessionList> ||
                            std::is_same_v<Message, StateTimes> || std::is_same_v<Message, FrameQuality>;

}  // namespace

void Voices::start(NetServer& net) {
  net_ = &net;
  thread_ = std::thread([this] { run(); });
}

void Voices::stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    for (auto& [session, voice] : voices_) end(voice);
    voices_.clear();
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

/// Waits for those that end.
void Voices::run() {
  name_thread("voices");
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return is_stopping_ || !ended_.empty(); });
    auto ended = std::exchange(ended_, {});
    if (ended.empty()) return;
    lock.unlock();
    ended.clear();
    lock.lock();
  }
}

void Voices::end(Voice& voice) {
  if (voice.link == nullptr) return;
  voice.link->begin_stop();
  ended_.push_back(std::move(voice.link));
  voice.ended_ns = now_ns();
  changed_.notify_all();
}

/// Null while it is not tried again.
UpstreamLink* Voices::find_or_open(SessionId session, const Hello& hello, size_t head) {
  if (is_stopping_) return nullptr;
  const auto [found, is_new] = voices_.try_emplace(session);
  Voice& voice = found->second;
  if (voice.link != nullptr) return voice.link.get();
  if (!is_new && now_ns() - voice.ended_ns < kSpeakAgainNs) return nullptr;
  const bool has_pictures = !hello.gets_no_stream;
  if (count_open() >= kMaxVoices) {
    voice.ended_ns = now_ns();
    tell(session,
         make_error(ErrorCode::Unavailable,
                    "{} viewers of this relay say something or get pictures already: try again later",
                    kMaxVoices),
         has_pictures);
    return nullptr;
  }
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
  voice.link = std::make_unique<UpstreamLink>(client_config_for(config_, hello), std::move(hooks));
  return voice.link.get();
}

void Voices::say(SessionId session, const Hello& viewer, const ClientMessage& message) {
  Hello hello;
  hello.role = viewer.role;
  hello.name = viewer.name;
  hello.token = viewer.token;
  hello.head = viewer.head;
  hello.gets_no_stream = true;
  const std::lock_guard lock(mutex_);
  if (UpstreamLink* link = find_or_open(session, hello, 0)) link->send(message);
}

void Voices::open_pictures(SessionId session, const Hello& viewer, size_t head) {
  Hello hello = viewer;
  hello.acknowledges = false;
  const std::lock_guard lock(mutex_);
  (void)find_or_open(session, hello, head);
}

void Voices::request_picture(SessionId session) {
  const std::lock_guard lock(mutex_);
  const auto found = voices_.find(session);
  if (found != voices_.end() && found->second.link != nullptr) found->second.link->request_keyframe();
}

void Voices::leave(SessionId session) {
  const std::lock_guard lock(mutex_);
  const auto found = voices_.find(session);
  if (found == voices_.end()) return;
  end(found->second);
  voices_.erase(found);
}

size_t Voices::count() const {
  const std::lock_guard lock(mutex_);
  return count_open();
}

size_t Voices::count_open() const {
  return static_cast<size_t>(std::count_if(voices_.begin(), voices_.end(),
                                           [](const auto& entry) { return entry.second.link != nullptr; }));
}

/// Who came for pictures has nothing else to stay for.
void Voices::tell(SessionId session, const Error& error, bool has_pictures) {
  if (has_pictures)
    net_->close(session, close_code_for(error), error.to_string());
  else
    net_->send(session, Notice{true, error.to_string()});
}

void Voices::on_event(SessionId session, size_t head, ClientEvent event) {
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

bool Voices::on_lost(SessionId session, const Error& error, bool has_pictures) {
  const std::lock_guard lock(mutex_);
  const auto found = voices_.find(session);
  if (found == voices_.end()) return false;
  end(found->second);
  tell(session, error, has_pictures);
  return false;
}

}  // namespace strandcast
