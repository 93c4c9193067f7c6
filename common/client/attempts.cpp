#include "common/client/attempts.h"

namespace strandcast {

Result<std::unique_ptr<ViewerClient>> connect_patiently(const ClientConfig& config,
                                                        std::chrono::milliseconds patience,
                                                        Standing standing) {
  ReconnectPolicy policy(static_cast<uint32_t>(now_ns()), kLongestUrgentDelay);
  if (standing == Standing::Member) policy.on_welcome(now_ns());
  const int64_t end_ns = now_ns() + std::chrono::nanoseconds(patience).count();
  while (true) {
    auto client = ViewerClient::connect(config);
    if (client) return client;
    const auto delay = policy.on_lost(client.error(), now_ns());
    if (!delay) return client.error();
    const int64_t next_ns = now_ns() + std::chrono::nanoseconds(*delay).count();
    if (next_ns >= end_ns) return client.error();
    while (now_ns() < next_ns) {
      if (auto why = config.cancel ? config.cancel() : std::nullopt) return *why;
      std::this_thread::sleep_for(kCancelPoll);
    }
  }
}

}  // namespace strandcast
