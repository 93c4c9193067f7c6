// Main tables of the streaming report's page: the bit rate that a viewer's link must carry, and every clip,
// strand model and wind. Any thread.
#pragma once

#include "server/report/html_page.h"
#include "server/report/streaming.h"

namespace strandcast {

/// Returns Mbit/s and milliseconds of both sides, at the goals' bound, of each of our codecs and of the best
/// peers. For the built-in scene and the largest number of vertices, in the first recording of each class.
HtmlTable needs_table(const StreamingReport& report);
/// Returns the conclusion in words: the codec with the fewest bits.
std::string needs_text(const StreamingReport& report);
/// Returns bits per vertex by bound, of every clip, part, strand model, codec of ours and wind, at the first
/// size.
HtmlTable case_table(const StreamingReport& report);
/// Returns which clips were available.
std::string clips_text(const StreamingReport& report);

}  // namespace strandcast
