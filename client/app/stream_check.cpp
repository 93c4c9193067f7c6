#include "client/app/stream_check.h"

#include <algorithm>
#include <utility>

#include "client/app/viewer_session.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kCheckPumpWait{5};

/// A viewer that keeps the hashes of the ticks it decoded.
struct HashingViewer {
  std::unique_ptr<ViewerSession> session;
  TickHashes hashes;

  void listen() {
    session->set_snapshot_listener([this](const auto& snapshot) {
      const StrandReplay& replay = session->replay();
      hashes.add({snapshot->tick, replay.stream_id(), replay.sequence()}, state_hash(*snapshot));
    });
  }
};

}  // namespace

void TickHashes::add(const Key& key, uint64_t hash) {
  if (!hash_by_key_.insert_or_assign(key, hash).second) return;
  order_.push_back(key);
  if (order_.size() <= limit_) return;
  hash_by_key_.erase(order_.front());
  order_.pop_front();
}

std::optional<uint64_t> TickHashes::find(const Key& key) const {
  const auto found = hash_by_key_.find(key);
  return found == hash_by_key_.end() ? std::nullopt : std::optional(found->second);
}

std::string StreamCheck::to_string() const {
  std::string text = fmt::format(
      "{} frames decoded by {}, {} ticks compared between two viewers, {} differ, {} frames rejected",
      decoded_frames, codec, compared_ticks, differing_ticks, rejected_frames);
  if (differing_ticks > 0) text += fmt::format(" (first at tick {})", first_differing_tick);
  if (compared_ticks == 0)
    text += " (the viewers got different streams: the link or this machine is too slow)";
  return text;
}

Result<StreamCheck> check_stream(const ClientConfig& config, uint64_t frames, double timeout_s) {
  const int64_t begin_ns = now_ns();
  HashingViewer first{nullptr, TickHashes(kKeptTicksPerFrame * frames)};
  HashingViewer second{nullptr, TickHashes(kKeptTicksPerFrame * frames)};
  ASSIGN_OR_RETURN(first.session, ViewerSession::open(config));
  first.listen();
  const auto is_done = [&] {
    return first.session->decoded_frames() >= frames && second.session &&
           second.hashes.hash_by_key().size() >= frames / 2;
  };
  while (!is_done()) {
    if (const auto why = config.cancel ? config.cancel() : std::nullopt) return *why;
    RETURN_IF_ERROR(first.session->pump(kCheckPumpWait));
    if (second.session) RETURN_IF_ERROR(second.session->pump(milliseconds(0)));
    // Half way in, so that the second one starts from a keyframe of its own in the middle of the chain.
    if (!second.session && first.session->decoded_frames() >= std::max<uint64_t>(frames / 2, 1)) {
      ASSIGN_OR_RETURN(second.session, ViewerSession::open(config));
      second.listen();
    }
    if (static_cast<double>(now_ns() - begin_ns) * 1e-9 > timeout_s)
      return make_error(ErrorCode::Timeout, "only {} of {} frames decoded in {} s{}{}",
                        first.session->decoded_frames(), frames, timeout_s,
                        first.session->replay().stats().last_error.empty() ? "" : "; last problem: ",
                        first.session->replay().stats().last_error);
  }

  StreamCheck check;
  check.codec = first.session->welcome().codec;
  check.decoded_frames = first.session->decoded_frames();
  check.rejected_frames =
      first.session->replay().stats().rejected_frames + second.session->replay().stats().rejected_frames;
  for (const auto& [key, hash] : second.hashes.hash_by_key()) {
    const auto other = first.hashes.find(key);
    if (!other) continue;
    ++check.compared_ticks;
    if (*other != hash && check.differing_ticks++ == 0) check.first_differing_tick = key.tick;
  }
  return check;
}

}  // namespace strandcast
