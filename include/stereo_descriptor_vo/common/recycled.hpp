#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// A vector with a free list: add() returns a removed element with its old contents, if there is one, so that its
/// memory is used again. An assignment copies the elements, not the free list, and keeps the memory of its target.
template <class Element>
class Recycled {
 public:
  Recycled() = default;
  Recycled(const Recycled& other) : elements_(other.elements_) {}
  Recycled(Recycled&&) noexcept = default;
  Recycled& operator=(Recycled&&) noexcept = default;
  Recycled& operator=(const Recycled& other) {
    for (; size() > other.size(); elements_.pop_back()) spare_.push_back(std::move(elements_.back()));
    while (size() < other.size()) add();
    elements_ = other.elements_;
    return *this;
  }

  std::size_t size() const { return elements_.size(); }
  Element& operator[](std::size_t i) { return elements_[i]; }
  const Element& operator[](std::size_t i) const { return elements_[i]; }
  auto begin() { return elements_.begin(); }
  auto end() { return elements_.end(); }
  auto begin() const { return elements_.begin(); }
  auto end() const { return elements_.end(); }

  Element& add() {
    if (spare_.empty()) return elements_.emplace_back();
    elements_.push_back(std::move(spare_.back()));
    spare_.pop_back();
    return elements_.back();
  }

  /// The others close up in their order.
  template <class Goes>
  void removeIf(const Goes& goes) {
    auto kept = begin();
    for (Element& element : elements_) {
      if (goes(element)) {
        spare_.push_back(std::move(element));
      } else {
        if (&*kept != &element) *kept = std::move(element);
        ++kept;
      }
    }
    elements_.erase(kept, end());
  }

 private:
  std::vector<Element> elements_, spare_;
};

}  // namespace sdvo
