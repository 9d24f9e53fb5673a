"""Unfolding as a transformer, for pipelines in the manner of scikit-learn."""

from __future__ import annotations

import sys
from dataclasses import fields
from inspect import Parameter, Signature
from typing import Any, overload

import numpy as np
import pandas as pd

from geounfold.errors import InputError, NotFittedError, OptionError, nearest
from geounfold.geometry.mesh import Floats
from geounfold.io.result_columns import FOLDED, UNFOLDED
from geounfold.unfolding.options import UnfoldOptions
from geounfold.unfolding.result import Unfolding
from geounfold.unfolding.run import unfold

_NAMES = tuple(field.name for field in fields(UnfoldOptions))


def _check_dense(X: Any) -> None:
    """Raise InputError for input that no body can be: sparse, complex, or not a table of three."""
    if hasattr(X, "toarray"):
        raise InputError("sparse input is not supported: give an array of (n, 3) coordinates")
    if isinstance(X, pd.DataFrame):
        return
    array = np.asarray(X)
    if np.iscomplexobj(array):
        raise InputError("Complex data not supported: coordinates are real numbers")
    if array.ndim == 2 and array.shape[1] != 3:
        raise InputError(
            f"points must have shape (n, 3), but have {array.shape[1]} feature(s) "
            f"(shape={array.shape}) while a minimum of 3 is required"
        )


def _not_fitted() -> type[NotFittedError]:
    """Return the error of an Unfolder that was not fitted; scikit-learn's too if it is loaded."""
    loaded = sys.modules.get("sklearn.exceptions")
    if loaded is None:
        return NotFittedError
    return type("NotFittedError", (NotFittedError, loaded.NotFittedError), {})


class Unfolder:
    """Takes folded coordinates to flat ones, after it was fitted to a body's blocks.

    ``fit`` unfolds the blocks given; ``transform`` carries any points with that map, so that in a
    pipeline fitted to blocks samples can be given later.  Fit it to the whole body: samples alone
    seldom fill one.  The three coordinates alone come out.  Points farther from the body than
    ``reach`` blocks have no image and come out as NaN, which most estimators refuse.

    Parameters
    ----------
    **options
        Fields of UnfoldOptions; what is not given has its default.

    Attributes
    ----------
    unfolding_ : Unfolding
        Of the blocks; after ``fit``.
    n_features_in_ : int
        Columns of what it was fitted to.

    Raises
    ------
    OptionError
        An option that does not exist.  Values are checked by ``fit``.

    Examples
    --------
    >>> import geounfold as gu
    >>> body = gu.simulate("sim_case_1", blocks=2000)
    >>> flat = gu.Unfolder(datum="top").fit_transform(body.folded)
    >>> flat.shape == body.folded.shape
    True
    """

    unfolding_: Unfolding
    n_features_in_: int

    def __init__(self, **options: Any) -> None:
        defaults = UnfoldOptions()
        self._take({name: getattr(defaults, name) for name in _NAMES} | options)

    def _take(self, options: dict[str, Any]) -> None:
        for name, value in options.items():
            if name not in _NAMES:
                raise OptionError(
                    f"there is no option {name}{nearest(name, _NAMES)}; valid: {', '.join(_NAMES)}"
                )
            setattr(self, name, value)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return every option; ``deep`` makes no difference."""
        return {name: getattr(self, name) for name in _NAMES}

    def set_params(self, **options: Any) -> Unfolder:
        """Change options, for the next ``fit``."""
        self._take(options)
        return self

    def fit(self, X: Floats | pd.DataFrame, y: Any = None) -> Unfolder:
        """Unfold a body.

        Parameters
        ----------
        X : (n, 3) array or DataFrame
            Its block centroids, as `unfold` takes them.
        y : any
            Not looked at.
        """
        _check_dense(X)
        self.unfolding_ = unfold(X, UnfoldOptions(**self.get_params()))
        self.n_features_in_ = np.asarray(X).shape[1]
        return self

    @overload
    def transform(self, X: pd.DataFrame) -> pd.DataFrame: ...
    @overload
    def transform(self, X: Floats) -> Floats: ...
    def transform(self, X: Floats | pd.DataFrame) -> Floats | pd.DataFrame:
        """Return points in the flat space.

        Parameters
        ----------
        X : (m, 3) array or DataFrame
            Folded points.

        Returns
        -------
        (m, 3) array or DataFrame
            As given; a DataFrame has the index of the one given and the columns unfolded_x,
            unfolded_y and unfolded_z.
        """
        found = self._fitted().transform(X)
        return found[list(UNFOLDED)] if isinstance(found, pd.DataFrame) else found

    @overload
    def inverse_transform(self, X: pd.DataFrame) -> pd.DataFrame: ...
    @overload
    def inverse_transform(self, X: Floats) -> Floats: ...
    def inverse_transform(self, X: Floats | pd.DataFrame) -> Floats | pd.DataFrame:
        """Return flat points in the folded space; see ``transform``."""
        found = self._fitted().inverse_transform(X)
        return found[list(FOLDED)] if isinstance(found, pd.DataFrame) else found

    @overload
    def fit_transform(self, X: pd.DataFrame, y: Any = None) -> pd.DataFrame: ...
    @overload
    def fit_transform(self, X: Floats, y: Any = None) -> Floats: ...
    def fit_transform(self, X: Floats | pd.DataFrame, y: Any = None) -> Floats | pd.DataFrame:
        """Unfold a body and return its blocks in the flat space."""
        return self.fit(X, y).transform(X)

    def get_feature_names_out(self, input_features: Any = None) -> np.ndarray:
        """Return the names of the columns that come out, whatever went in."""
        return np.array(UNFOLDED, dtype=object)

    def _fitted(self) -> Unfolding:
        if not self.__sklearn_is_fitted__():
            raise _not_fitted()("this Unfolder has unfolded nothing yet: call fit first")
        return self.unfolding_

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "unfolding_")

    def __sklearn_tags__(self) -> Any:
        """Tell scikit-learn, which alone asks, that this is a transformer without a target."""
        from sklearn.utils import InputTags, Tags, TargetTags, TransformerTags

        return Tags(
            estimator_type=None,
            target_tags=TargetTags(required=False),
            transformer_tags=TransformerTags(),
            input_tags=InputTags(),
        )

    def __repr__(self) -> str:
        defaults = UnfoldOptions()
        changed = {n: v for n, v in self.get_params().items() if v != getattr(defaults, n)}
        return f"Unfolder({', '.join(f'{name}={value!r}' for name, value in changed.items())})"


# What the options are, for tools that read signatures: completion, and scikit-learn's checks.
Unfolder.__init__.__signature__ = Signature(  # type: ignore[attr-defined]
    [
        Parameter("self", Parameter.POSITIONAL_OR_KEYWORD),
        *(
            Parameter(name, Parameter.KEYWORD_ONLY, default=getattr(UnfoldOptions(), name))
            for name in _NAMES
        ),
    ]
)
