// Bindings on which the kernels of study/*.comp and their host agree. Included by both: only "const uint"
// lines here, with names that no other header uses.
#ifndef STRANDCAST_SHADERS_SHARED_SCATTER_STUDY_H
#define STRANDCAST_SHADERS_SHARED_SCATTER_STUDY_H

#ifdef __cplusplus
#include <cstdint>
namespace strandcast::shader {
using uint = uint32_t;
#endif

const uint kBindingStudyNodes = 0u;
const uint kBindingStudyBins = 1u;
const uint kBindingStudyMembers = 2u;  // ranks, or samples of the bins
const uint kBindingStudySorted = 3u;
const uint kBindingStudyPlanes = 4u;

// Texture units.
const uint kUnitStudySample = 0u;
const uint kUnitStudySum = 1u;

#ifdef __cplusplus
}  // namespace strandcast::shader
#endif

#endif
