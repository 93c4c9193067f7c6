#include "server/app/viewer_codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/base/text.h"
#include "common/base/units.h"
#include "common/wire/messages.h"
#include "server/net/strand_class.h"

namespace strandcast {
namespace {

double state_ms(const ViewerCodecFacts& facts) {
  return facts.step_ns * kMsPerNs * static_cast<double>(facts.vertices) * facts.substeps * facts.solver_cost;
}

double core_share(const ViewerCodecFacts& facts) {
  return state_ms(facts) * kSPerMs * facts.states_hz;
}

bool is_link_wide(const ViewerCodecFacts& facts) {
  return facts.fallback_bytes_per_s > 0.0 && facts.link_bytes_per_s > kWideLink * facts.fallback_bytes_per_s;
}

/// Why the codec that predicts is not for this viewer; empty when it is.
std::string against_predicting(const StrandCodecInfo& codec, const ViewerCodecFacts& facts) {
  if (facts.step_ns <= 0.0)
    return "this viewer cannot predict (not yet, or it is an older one, or built without kernels)";
  if (core_share(facts) > kPredictionShare)
    return fmt::format("{} would take {:.1f} ms a state on this machine, {:.0f} % of a core; {:.0f} % may be",
                       codec.name, state_ms(facts), core_share(facts) * 1e2, kPredictionShare * 1e2);
  if (is_link_wide(facts))
    return fmt::format("the link carries {:.1f} Mbit/s, more than {:g} times what this takes",
                       facts.link_bytes_per_s * kBitsPerByte * 1e-6, kWideLink);
  return {};
}

std::string for_predicting(const StrandCodecInfo& codec, const ViewerCodecFacts& facts) {
  std::string text = fmt::format("{:.1f} ms a state on this machine", state_ms(facts));
  if (codec.bytes_share < 1.0)
    text += fmt::format(", an estimated 1/{:.0f} of {}'s bytes", 1.0 / codec.bytes_share, codec.fallback);
  return text;
}

/// Without a wish that can be met.
ViewerCodec choose_by_ability(const std::vector<StrandCodecInfo>& served, const ViewerCodecFacts& facts) {
  const StrandCodecInfo& first = served.front();
  if (!first.predicts) return {0, "the scene's codec"};
  const std::string against = against_predicting(first, facts);
  if (against.empty()) return {0, for_predicting(first, facts)};
  if (served.size() > 1) return {1, against};
  return {0, "no other codec is served; " + against};
}

ViewerCodec choose(const std::vector<StrandCodecInfo>& served, const ViewerCodecFacts& facts) {
  if (facts.wish.empty()) return choose_by_ability(served, facts);
  const auto wanted = std::find_if(served.begin(), served.end(),
                                   [&](const StrandCodecInfo& one) { return one.name == facts.wish; });
  const bool is_decodable = wanted != served.end() && (!wanted->predicts || facts.step_ns > 0.0);
  if (is_decodable) return {static_cast<size_t>(wanted - served.begin()), "asked for"};
  ViewerCodec chosen = choose_by_ability(served, facts);
  if (wanted == served.end())
    chosen.reason = fmt::format("{} was asked for and is not served; {}", one_line(facts.wish, kMaxNameChars),
                                chosen.reason);
  return chosen;
}

}  // namespace

Result<std::vector<StrandCodecInfo>> served_codecs(const StrandCodecInfo& codec, float bound_m) {
  std::vector<StrandCodecInfo> served = {codec};
  ASSIGN_OR_RETURN(const float step_m, lattice_step_m(codec.name, bound_m));
  if (codec.fallback.empty() || codec.fallback == codec.name) return served;
  ASSIGN_OR_RETURN(StrandCodecInfo fallback, strand_codec_info(codec.fallback));
  ASSIGN_OR_RETURN(const float fallback_step_m, lattice_step_m(fallback.name, bound_m));
  if (fallback_step_m == step_m) served.push_back(std::move(fallback));
  return served;
}

ViewerCodec choose_viewer_codec(const std::vector<StrandCodecInfo>& served, const ViewerCodecFacts& facts) {
  CHECK(!served.empty() && served.size() <= kMaxServedCodecs);
  ViewerCodec chosen = choose(served, facts);
  chosen.reason = fmt::format("{}: {}", served[chosen.codec].name, chosen.reason);
  return chosen;
}

std::string explain_viewer_codecs(const std::vector<StrandCodecInfo>& served) {
  CHECK(!served.empty());
  const std::string& first = served.front().name;
  if (served.size() == 1) return fmt::format("Every viewer of strands gets {}.", first);
  if (!served.front().predicts)
    return fmt::format("Viewers of strands get {}, those who ask for it {}.", first, served[1].name);
  return fmt::format(
      "Viewers of strands get {} where predicting takes at most {:.0f} % of a core of theirs, else {}; "
      "pictures are "
      "drawn from {}.",
      first, kPredictionShare * 1e2, served[1].name, served[1].name);
}

std::optional<ViewerCodec> ViewerCodecWatch::look(const std::vector<StrandCodecInfo>& served,
                                                  const ViewerCodecFacts& facts, const DecodeLoad& load,
                                                  int64_t time_ns) {
  const bool is_other_model = facts.solver != facts_.solver || facts.substeps != facts_.substeps ||
                              facts.solver_cost != facts_.solver_cost;
  const bool has_learnt = facts_.step_ns <= 0.0 && facts.step_ns > 0.0;
  if (is_other_model || has_learnt) {
    facts_ = facts;
    slow_since_ns_.reset();
    settled_ns_ = time_ns + kSettledDecodeNs;
    ViewerCodec chosen = choose_viewer_codec(served, facts);
    if (std::exchange(codec_, chosen.codec) == chosen.codec) return std::nullopt;
    return chosen;
  }
  const StrandCodecInfo& present = served[codec_];
  const size_t fallback = codec_ + 1;
  if (!present.predicts || fallback >= served.size()) return std::nullopt;
  if (is_wrong(load, time_ns)) {
    codec_ = fallback;
    return ViewerCodec{fallback, fmt::format("{}: by {} this viewer's states are not the server's",
                                             served[fallback].name, present.name)};
  }
  if (present.name == facts.wish || !is_too_slow(load, time_ns)) return std::nullopt;
  codec_ = fallback;
  return ViewerCodec{
      fallback,
      fmt::format("{}: {} takes {:.1f} ms a state here, {:.0f} % of the time between two; {:.0f} % may be",
                  served[fallback].name, present.name, load.decode_ms,
                  load.decode_ms * kSPerMs * load.states_hz * 1e2, kSlowDecodeShare * 1e2)};
}

bool ViewerCodecWatch::is_wrong(const DecodeLoad& load, int64_t time_ns) {
  if (time_ns >= wrong_until_ns_) wrong_before_ = wrong_seen_;
  if (load.wrong_states != wrong_seen_ && wrong_seen_ == wrong_before_)
    wrong_until_ns_ = time_ns + kWrongStatesNs;
  wrong_seen_ = load.wrong_states;
  return wrong_seen_ - wrong_before_ > kMostWrongStates;
}

bool ViewerCodecWatch::is_too_slow(const DecodeLoad& load, int64_t time_ns) {
  const bool is_slow = load.decode_ms * kSPerMs * load.states_hz > kSlowDecodeShare;
  if (!is_slow || time_ns < settled_ns_) {
    slow_since_ns_.reset();
    return false;
  }
  if (!slow_since_ns_) slow_since_ns_ = time_ns;
  return time_ns - *slow_since_ns_ >= kSlowDecodeNs;
}

}  // namespace strandcast
