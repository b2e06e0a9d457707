#pragma once

#if SDVO_EMBREE >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace sdvo::render {

// Embree 3 and 4 tell a query how to go about it in different ways.

/// What the packet's rays hit first. They start at one point: work is shared between neighbours.
inline void intersectTogether(RTCScene scene, const int* valid, RTCRayHit16& rays) {
#if SDVO_EMBREE >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &rays, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &context, &rays);
#endif
}

/// Whether the ray hits anything: its end is negative then.
inline bool isOccluded(RTCScene scene, RTCRay& ray) {
#if SDVO_EMBREE >= 4
  rtcOccluded1(scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
#endif
  return ray.tfar < 0.0f;
}

}  // namespace sdvo::render
