"""Posterior predictive check: would the same analysis of simulated recordings answer the same?"""
