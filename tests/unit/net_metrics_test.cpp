// What /metrics says of the network: every counter, under its own name.
#include "server/net/metrics.h"

#include "server/net/net_server.h"
#include "tests/support/metrics_text.h"

namespace strandcast::net_metrics_test {
namespace {

struct Told {
  const char* name;
  uint64_t NetCounters::*counter;
};
constexpr Told kTold[] = {{"open_sessions", &NetCounters::open_sessions},
                          {"joined_sessions", &NetCounters::joined_sessions},
                          {"connections_total", &NetCounters::connections},
                          {"accept_errors_total", &NetCounters::accept_errors},
                          {"refused_full_total", &NetCounters::refused_full},
                          {"refused_token_total", &NetCounters::refused_token},
                          {"refused_rate_total", &NetCounters::refused_rate},
                          {"refused_tls_total", &NetCounters::refused_tls},
                          {"refused_http_total", &NetCounters::refused_http},
                          {"bad_messages_total", &NetCounters::bad_messages},
                          {"stalled_total", &NetCounters::stalled},
                          {"timeouts_total", &NetCounters::timeouts},
                          {"messages_received_total", &NetCounters::messages_received},
                          {"unknown_messages_total", &NetCounters::unknown_messages},
                          {"frames_sent_total", &NetCounters::frames_sent},
                          {"frames_dropped_total", &NetCounters::frames_dropped},
                          {"chain_losses_total", &NetCounters::chain_losses},
                          {"keyframe_requests_total", &NetCounters::keyframe_requests},
                          {"class_changes_total", &NetCounters::class_changes},
                          {"codec_changes_total", &NetCounters::codec_changes},
                          {"mode_changes_total", &NetCounters::mode_changes},
                          {"sent_bytes_total", &NetCounters::bytes_sent}};
static_assert(sizeof(NetCounters) == std::size(kTold) * sizeof(uint64_t), "a new counter needs its row here");

TEST(NetMetrics, EveryCounterIsToldUnderItsOwnName) {
  NetCounters counters;
  uint64_t value = 100;
  for (const Told& told : kTold) counters.*told.counter = ++value;
  std::vector<std::string> faults;
  const auto families = test::read_metrics(format_metrics(counters), faults);
  EXPECT_TRUE(faults.empty());
  EXPECT_EQ(families.size(), std::size(kTold));
  for (const Told& told : kTold) {
    const auto found = families.find(fmt::format("strandcast_net_{}", told.name));
    ASSERT_NE(found, families.end()) << told.name;
    ASSERT_EQ(found->second.samples.size(), 1u) << told.name;
    EXPECT_EQ(found->second.samples[0].second, static_cast<double>(counters.*told.counter)) << told.name;
  }
}

}  // namespace
}  // namespace strandcast::net_metrics_test
