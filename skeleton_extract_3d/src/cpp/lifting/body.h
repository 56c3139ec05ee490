/** How many joints, limbs and pairs there are in a body, see body.py. */
#pragma once

namespace skeleton_extract_3d
{
constexpr int ROOTS = 4, LIMBS = 4, PAIRS = 2, CHAINED = 12;
}  // namespace skeleton_extract_3d
