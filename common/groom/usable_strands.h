// Strands that can be used: those of a file that are broken or empty are left out and counted. Any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "common/base/mercy.h"
#include "common/base/result.h"
#include "common/groom/stated_groom.h"

namespace strandcast {

/// Leaves out strands with a point that is not finite or far from all other hair, and those that show
/// nothing: of fewer than two points or without length. Coordinates of roots that are not finite are bridged.
/// Notes count them. BadInput when nothing is left, or when more than a tenth is broken or shows
/// nothing.
Result<StatedGroom> with_usable_strands(StatedGroom stated);

/// Makes points as many as strands need. Where a file has a tenth too few or too many at most, a note counts
/// them: what is not there is not finite, so that with_usable_strands() leaves out its strands. `source` says
/// who needs them. BadInput for more.
Status fit_points(std::vector<glm::vec3>& points, uint64_t needed, const char* source,
                  std::vector<std::string>& notes);
/// The same by the points of each strand. BadInput too where a count in the middle is wrong: strands behind
/// it begin at a point of others.
Status fit_points(std::vector<glm::vec3>& points, std::span<const uint32_t> counts, const char* source,
                  std::vector<std::string>& notes);

/// Says of a strand that it shows nothing, and what becomes of such: noted, refused where more than one and a
/// tenth are so.
Error empty_strand(size_t strand);
Status settle_empty(const BadItems& empty, uint64_t strand_count, std::vector<std::string>& notes);
/// Leaves guides out of the hair, or takes them alone; where there is nothing but guides, they are the hair.
/// Returns what to say of it. `by` names what flags them: " (groom_guide)".
std::string part_guides(Groom& groom, StrandLabels& labels, std::vector<uint8_t> is_guide, GuideUse use,
                        const char* by = "");
/// Gives strands that lack what others have further ids, a group of their own, the usual width and the
/// nearest root's coordinates; lists that all lack are cleared. Returns what to say of it.
std::string fill_lacking(Groom& groom, StrandLabels& labels);
/// Adds what there is to say.
inline void add_note(std::vector<std::string>& notes, std::string note) {
  if (!note.empty()) notes.push_back(std::move(note));
}

/// Removes the strands whose element is 0, with all that is said of them; takes no further memory.
void keep_strands(Groom& groom, StrandLabels& labels, std::span<const uint8_t> is_kept);

}  // namespace strandcast
