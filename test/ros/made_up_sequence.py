"""Stereo pairs without a data set: a camera that moves sideways past two walls."""

import cv2
import numpy as np
from sensor_msgs.msg import CameraInfo

WIDTH, HEIGHT, FOCAL, BASELINE = 640, 240, 400.0, 0.2
STEP = 0.02  # m from one pair to the next
DISPARITIES = 40, 20  # px, of the upper and of the lower wall: 2 and 4 m away


class MadeUpSequence:
    """As kitti_replay's StereoSequence."""

    def __init__(self, count, seed=1):
        self.random = np.random.RandomState(seed)
        walls = [self.wall(WIDTH + DISPARITIES[0] + 10 * count) for _ in DISPARITIES]
        self.pairs = [[np.vstack([self.view(wall, disparity, i, side) for wall, disparity in zip(walls, DISPARITIES)])
                       for side in range(2)] for i in range(count)]
        projection = [FOCAL, 0, WIDTH / 2, 0, 0, FOCAL, HEIGHT / 2, 0, 0, 0, 1, 0]
        self.projections = [projection, projection[:3] + [-FOCAL * BASELINE] + projection[4:]]

    def wall(self, width):
        """Rectangles of all greys."""
        wall = np.full((HEIGHT // 2, width), 128, np.uint8)
        for _ in range(width * 3):
            x, y = self.random.randint(0, width), self.random.randint(0, HEIGHT // 2)
            w, h = self.random.randint(4, 16, 2)
            cv2.rectangle(wall, (x, y), (x + int(w), y + int(h)), int(self.random.randint(0, 256)), -1)
        return cv2.GaussianBlur(wall, (3, 3), 0)

    def view(self, wall, disparity, i, side):
        first = round(disparity * STEP / BASELINE * i) + side * disparity
        noise = self.random.normal(0, 2, (HEIGHT // 2, WIDTH))
        return np.clip(wall[:, first:first + WIDTH] + noise, 0, 255).astype(np.uint8)

    def camera_info(self, side):
        info = CameraInfo(height=HEIGHT, width=WIDTH, distortion_model='plumb_bob', D=[0.0] * 5, P=self.projections[side])
        info.K = [FOCAL, 0, WIDTH / 2, 0, FOCAL, HEIGHT / 2, 0, 0, 1]
        info.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
        return info
