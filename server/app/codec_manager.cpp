#include "server/app/codec_manager.h"

#include <fmt/format.h>

#include <algorithm>

namespace strandcast {

ViewerCodecFacts CodecManager::facts(const std::string& wish, double step_ns,
                                     const SimulatedModel& model) const {
  ViewerCodecFacts facts;
  facts.wish = wish;
  facts.step_ns = step_ns;
  facts.vertices = served_.vertices;
  facts.states_hz = served_.states_hz;
  facts.solver = model.solver;
  facts.solver_cost = model.solver_cost;
  facts.substeps = std::max<uint32_t>(model.substeps, 1);
  return facts;
}

ViewerCodec CodecManager::admit(SessionId session, const Hello& hello, const SimulatedModel& model) {
  if (!hello.relay_id.empty()) {
    const auto wanted = std::find_if(served_.codecs.begin(), served_.codecs.end(),
                                     [&](const auto& one) { return one.name == hello.codec_wish; });
    const size_t codec = wanted == served_.codecs.end() ? 0 : wanted - served_.codecs.begin();
    return {codec, fmt::format("{}: as the relay asks", served_.codecs[codec].name)};
  }
  // Nothing is known of its link yet.
  const ViewerCodecFacts facts_now = facts(hello.codec_wish, hello.step_ns, model);
  ViewerCodec chosen = choose_viewer_codec(served_.codecs, facts_now);
  const bool gets_stream = hello.role != Role::Source && !hello.gets_no_stream;
  if (served_.codecs.size() > 1 && gets_stream)
    watches_.insert_or_assign(session, ViewerCodecWatch(facts_now, chosen.codec));
  return chosen;
}

std::optional<CodecAnswer> CodecManager::consider(SessionId session, const Look& look, int64_t time_ns) {
  const auto found = watches_.find(session);
  if (found == watches_.end()) return std::nullopt;
  ViewerCodecWatch& watch = found->second;
  DecodeLoad load;
  load.decode_ms = look.report.decode_ms;
  load.wrong_states = look.report.wrong_states;
  if (look.link.mode == StreamMode::Strands && !look.model.is_paused)
    load.states_hz = look.states_hz * std::min(look.model.realtime_factor, 1.0);
  const double step_ns = look.report.step_ns > 0.0 ? look.report.step_ns : watch.facts().step_ns;
  const ViewerCodecFacts facts_now = facts(watch.facts().wish, step_ns, look.model);
  const std::optional<ViewerCodec> chosen = watch.look(served_.codecs, facts_now, load, time_ns);
  if (!chosen) return std::nullopt;
  return CodecAnswer{chosen->codec, served_.codecs[chosen->codec].name, chosen->reason};
}

}  // namespace strandcast
