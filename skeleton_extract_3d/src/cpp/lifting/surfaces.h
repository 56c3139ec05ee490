/** What the twins of other modules need of surfaces.py. */
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "arrays.h"

namespace skeleton_extract_3d
{
/** The nearest integer from `first` to `last`; NaN is taken for the first. */
inline int nearestWithin(double position, int first, int last)
{
  return position > first ? static_cast<int>(std::lrint(std::min(position, static_cast<double>(last)))) : first;
}

/** The valid samples of a window, their weights with sum 1. */
class Window
{
public:
  explicit Window(const double* weights, int samples) : weights_(weights), samples_(samples), weight_(samples)
  {
  }

  /** Look at a window; return whether it has any valid sample. */
  bool look(const double* depth)
  {
    depth_ = depth;
    double total = 0.0;
    for (int i = 0; i < samples_; ++i)
    {
      weight_[i] = std::isfinite(depth[i]) ? weights_[i] : 0.0;
      total += weight_[i];
    }
    for (int i = 0; i < samples_ && total > 0.0; ++i)
    {
      weight_[i] /= total;
    }
    return total > 0.0;
  }

  /**
   * Fill histograms of all samples, and of those that are not foreign; both are the same where `foreign` is null.
   *
   * position: function from depth to number of the bin; first: number of the first bin; it and the last one are open.
   */
  template <typename Position>
  void fill(const bool* foreign, const Position& position, int first, std::vector<double>& all,
            std::vector<double>& own) const
  {
    const int last = first + static_cast<int>(all.size()) - 1;
    std::fill(all.begin(), all.end(), 0.0);
    std::fill(own.begin(), own.end(), 0.0);
    for (int i = 0; i < samples_; ++i)
    {
      if (weight_[i] > 0.0)
      {
        const int bin = nearestWithin(position(depth_[i]), first, last) - first;
        all[bin] += weight_[i];
        own[bin] += foreign != nullptr && foreign[i] ? 0.0 : weight_[i];
      }
    }
  }

  double weight(int sample) const
  {
    return weight_[sample];
  }

private:
  const double* weights_;
  int samples_;
  const double* depth_ = nullptr;
  std::vector<double> weight_;
};

/** Depths at which a trunk is looked for, and what a person's size in the image says of them. */
struct SizeSettings
{
  std::vector<double> log_depths;
  double foreshortening, weight, limit;

  /** Return the log likelihood of a depth for a person who looks like being at a depth. */
  double evidence(std::size_t depth, double log_size, double spread) const
  {
    double t = log_depths[depth] - log_size;
    t = std::isfinite(t) ? t : 0.0;
    t /= t > 0.0 ? spread : foreshortening + spread;
    return std::max(-0.5 * weight * t * t, limit);
  }
};

SizeSettings sizeSettings(const Doubles& depths, double foreshortening, double weight, double limit);

/** Return the lower median of the valid ones of some samples; NaN where there is none. */
double lowerMedian(const double* samples, int count, std::vector<double>& valid);
}  // namespace skeleton_extract_3d
