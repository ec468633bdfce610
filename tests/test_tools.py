"""The tools that make data run and make what they say."""

import make_large_image
import numpy as np

from iccbrdf.images import open_tiff


def test_a_large_image_is_the_demo_s_print_tiled(tmp_path, monkeypatch):
    path = tmp_path / "large.tif"
    monkeypatch.setattr("sys.argv", ["make_large_image.py", str(path), "--megapixels", "1.44"])
    make_large_image.main()
    with open_tiff(path) as image:
        assert (image.height, image.width, image.samples) == (1200, 1200, "device")
        assert image.names[-3:] == ("n.x", "n.y", "n.z")
        pixels = np.concatenate([block.data for block in image.blocks()])
    # The print is 1063 pixels high and 1000 wide.
    assert np.array_equal(pixels[1063:], pixels[: 1200 - 1063])
    assert np.array_equal(pixels[:, 1000:], pixels[:, :200])
    assert not np.array_equal(pixels[:, 100:], pixels[:, :-100])
